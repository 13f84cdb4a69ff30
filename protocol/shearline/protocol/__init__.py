"""The wire: space, messages, codec, keys and sessions. No policy lives here."""

from shearline.protocol.errors import (
    ConfigError,
    LinkError,
    ProtocolError,
    RecordError,
    ShearlineError,
    SpaceError,
)
from shearline.protocol.space import Parameter, Space

__all__ = [
    "ConfigError",
    "LinkError",
    "Parameter",
    "ProtocolError",
    "RecordError",
    "ShearlineError",
    "Space",
    "SpaceError",
]
