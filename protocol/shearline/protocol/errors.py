"""The package's errors: one base, one class per mistake.

Every message is one sentence a person can act on: what was expected, what came, what to do.
"""

from __future__ import annotations


class ShearlineError(Exception):
    """Base of every error that Shearline raises on purpose."""


class ProtocolError(ShearlineError):
    """A peer sent bytes or a message that the protocol does not allow."""


class SpaceError(ShearlineError, ValueError):
    """A parameter space, or a tuple meant for one, is malformed."""


class LinkError(ShearlineError):
    """A session could not be opened, or its endpoint is taken or unreachable."""


class ConfigError(ShearlineError, ValueError):
    """What was asked for cannot be run as written."""


class RecordError(ShearlineError):
    """A run folder, journal or record cannot be read or written."""
