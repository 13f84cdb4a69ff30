"""What a trial looks like in space: bodies, how they hang together, and which column moves them.

An evaluator says it once for all its trials, so that whoever has a trace can draw it without an
engine. Positions are in m in the parent's frame, quaternions are ``[x, y, z, w]``. Nothing here is
about forces, masses or contacts.
"""

from __future__ import annotations

import enum
from typing import Annotated

import msgspec
from msgspec import Meta

from shearline.protocol.messages import Message
from shearline.protocol.pose import Quaternion, Vector

Label = Annotated[str, Meta(min_length=1, max_length=64)]


class ShapeKind(enum.StrEnum):
    """A shape about its own centre; round ones lie along z."""

    BOX = "box"  # size: half edges x, y, z
    SPHERE = "sphere"  # size: radius
    CYLINDER = "cylinder"  # size: radius, half length
    CAPSULE = "capsule"  # size: radius, half length without the caps


class Joint(enum.StrEnum):
    """How a body moves in its parent's frame."""

    FIXED = "fixed"
    HINGE = "hinge"  # its column [rad] turns it about the axis
    SLIDE = "slide"  # its column [m] shifts it along the axis


class Shape(msgspec.Struct, frozen=True, kw_only=True):
    """One visible piece of a body.

    Attributes:
        kind: What it is.
        size: As the kind says [m].
        position: Of its centre in the body's frame [m].
        quaternion: Its turn in the body's frame.
        colour: Red, green, blue and how little one sees through it, 0 to 1.
    """

    kind: ShapeKind
    size: Annotated[list[float], Meta(min_length=1, max_length=3)]
    position: Vector
    quaternion: Quaternion
    colour: Annotated[list[float], Meta(min_length=4, max_length=4)]


class Body(msgspec.Struct, frozen=True, kw_only=True):
    """One frame with what is fixed to it.

    Attributes:
        name: Unique in the scene.
        parent: The body it hangs on, named before it; ``""`` for the world.
        position: Of its frame in the parent's, with the joint at zero [m].
        quaternion: Turn of its frame in the parent's, with the joint at zero.
        joint: How it moves.
        axis: Of its joint, in its own frame.
        column: Column of a trace that moves it, ``""`` for none.
        shapes: What one sees of it.
    """

    name: Label
    parent: Annotated[str, Meta(max_length=64)]
    position: Vector
    quaternion: Quaternion
    joint: Joint
    axis: Vector
    column: Annotated[str, Meta(max_length=64)]
    shapes: Annotated[list[Shape], Meta(max_length=256)]


class SceneData(Message, frozen=True, kw_only=True, tag="scene"):
    """What all trials of an evaluator look like.

    Attributes:
        bodies: Parents before children; one whose parent is not there hangs on the world.
        tip_in: Body in whose frame the columns ``tip.x, tip.y, tip.z`` are; ``""`` for the world.
    """

    bodies: Annotated[list[Body], Meta(max_length=256)]
    tip_in: Annotated[str, Meta(max_length=64)] = ""
