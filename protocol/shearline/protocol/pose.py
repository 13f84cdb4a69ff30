"""Where something stands: position and turn in the frame of something else, as plain lists.

Lengths in m; a quaternion is ``[x, y, z, w]``. What stands there is not known here.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

Vector = Annotated[list[float], Meta(min_length=3, max_length=3)]
Quaternion = Annotated[list[float], Meta(min_length=4, max_length=4)]


class Placed(msgspec.Struct, frozen=True, kw_only=True):
    """Where one body of the scene stood all through a trial, other than in other trials.

    Attributes:
        body: Its name in the scene.
        position: In its parent's frame [m].
        quaternion: Its turn in the parent's frame.
    """

    body: Annotated[str, Meta(max_length=64)]
    position: Vector
    quaternion: Quaternion
