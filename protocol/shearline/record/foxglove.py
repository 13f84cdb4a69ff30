"""The standard ``foxglove.*`` types that the record uses, with their published field numbers.

Written down here so that neither protoc nor another package is needed; a viewer recognises them
by name. Nothing else about Foxglove is known here.
"""

from __future__ import annotations

import enum
import functools
import struct
from typing import Any

import numpy as np
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto

from shearline.protocol.messages import TraceData

#: Poses kept of one tip path: enough for a smooth line, a hundredth of a trace's size.
TIP_POSES_MAX = 200
TIP_AXES = ("tip.x", "tip.y", "tip.z")
#: One pose as field 3 of a ``PosesInFrame``, not turned: tags, lengths and the numbers' places.
_POSE = np.frombuffer(
    b"\x1a\x28\x0a\x1b"
    + b"".join(bytes([tag]) + bytes(8) for tag in (0x09, 0x11, 0x19))
    + b"\x12\x09\x21"
    + struct.pack("<d", 1.0),
    dtype=np.uint8,
)
_POSITION = np.dtype(
    {"names": ["x", "y", "z"], "formats": ["<f8"] * 3, "offsets": [5, 14, 23], "itemsize": 42}
)

_TYPES = {
    "string": FieldDescriptorProto.TYPE_STRING,
    "bool": FieldDescriptorProto.TYPE_BOOL,
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "fixed32": FieldDescriptorProto.TYPE_FIXED32,
}
_TIME = ".google.protobuf.Timestamp"

#: Message to its fields in order of their numbers 1, 2, ...; ``[]`` marks a repeated one, an empty
#: name a number that is not used here.
_MESSAGES: dict[str, tuple[tuple[str, str], ...]] = {
    "Vector3": (("x", "double"), ("y", "double"), ("z", "double")),
    "Quaternion": (("x", "double"), ("y", "double"), ("z", "double"), ("w", "double")),
    "Color": (("r", "double"), ("g", "double"), ("b", "double"), ("a", "double")),
    "Pose": (("position", ".foxglove.Vector3"), ("orientation", ".foxglove.Quaternion")),
    "PosesInFrame": (("timestamp", _TIME), ("frame_id", "string"), ("poses", ".foxglove.Pose[]")),
    "FrameTransform": (
        ("timestamp", _TIME),
        ("parent_frame_id", "string"),
        ("child_frame_id", "string"),
        ("translation", ".foxglove.Vector3"),
        ("rotation", ".foxglove.Quaternion"),
    ),
    "FrameTransforms": (("transforms", ".foxglove.FrameTransform[]"),),
    "ArrowPrimitive": (
        ("pose", ".foxglove.Pose"),
        ("shaft_length", "double"),
        ("shaft_diameter", "double"),
        ("head_length", "double"),
        ("head_diameter", "double"),
        ("color", ".foxglove.Color"),
    ),
    "CubePrimitive": (
        ("pose", ".foxglove.Pose"),
        ("size", ".foxglove.Vector3"),
        ("color", ".foxglove.Color"),
    ),
    "SpherePrimitive": (
        ("pose", ".foxglove.Pose"),
        ("size", ".foxglove.Vector3"),
        ("color", ".foxglove.Color"),
    ),
    "CylinderPrimitive": (
        ("pose", ".foxglove.Pose"),
        ("size", ".foxglove.Vector3"),
        ("bottom_scale", "double"),
        ("top_scale", "double"),
        ("color", ".foxglove.Color"),
    ),
    # the primitives of a later number are not used here; whoever reads us finds none of them
    "SceneEntity": (
        ("timestamp", _TIME),
        ("frame_id", "string"),
        ("id", "string"),
        ("", ""),
        ("frame_locked", "bool"),
        ("", ""),
        ("arrows", ".foxglove.ArrowPrimitive[]"),
        ("cubes", ".foxglove.CubePrimitive[]"),
        ("spheres", ".foxglove.SpherePrimitive[]"),
        ("cylinders", ".foxglove.CylinderPrimitive[]"),
    ),
    "SceneUpdate": (("", ""), ("entities", ".foxglove.SceneEntity[]")),
    "Log": (
        ("timestamp", _TIME),
        ("level", ".foxglove.Log.Level"),
        ("message", "string"),
        ("name", "string"),
        ("file", "string"),
        ("line", "fixed32"),
    ),
}


class Level(enum.IntEnum):
    """Severity of a ``foxglove.Log``."""

    UNKNOWN = 0
    DEBUG = 1
    INFO = 2
    WARNING = 3
    ERROR = 4
    FATAL = 5


@functools.cache
def foxglove_file() -> FileDescriptorProto:
    """Return one descriptor file with all the types above."""
    file = FileDescriptorProto(name="foxglove/shearline.proto", package="foxglove", syntax="proto3")
    file.dependency.append("google/protobuf/timestamp.proto")
    for name, fields in _MESSAGES.items():
        message = file.message_type.add(name=name)
        for number, (field_name, kind) in enumerate(fields, start=1):
            if field_name:
                _set_type(message.field.add(name=field_name, number=number), kind)
        if name == "Log":
            levels = message.enum_type.add(name="Level")
            for level in Level:
                levels.value.add(name=level.name, number=level.value)
    return file


def log_line(level: Level, text: str, at_ns: int) -> dict[str, Any]:
    """Return the values of one ``foxglove.Log``, said at ``at_ns`` [ns since the epoch]."""
    return {
        "timestamp": timestamp(at_ns),
        "level": int(level),
        "message": text,
        "name": "recorder",
    }


def tip_poses(trace: TraceData) -> bytes:
    """Return the poses of a ``foxglove.PosesInFrame``, encoded; empty if the trace has no tip.

    They are laid out by hand: as objects they would cost the recorder as much as the whole trace.
    """
    if not set(TIP_AXES) <= set(trace.names) or not trace.samples:
        return b""
    columns = np.frombuffer(trace.data, dtype="<f4").reshape(len(trace.names), trace.samples)
    every = -(-trace.samples // TIP_POSES_MAX)
    poses = np.tile(_POSE, (-(-trace.samples // every), 1))
    positions = poses.view(_POSITION)[:, 0]
    for field, axis in zip("xyz", TIP_AXES, strict=True):
        positions[field] = columns[trace.names.index(axis), ::every]
    return poses.tobytes()


def timestamp(at_ns: int) -> dict[str, int]:
    """Return the values of a ``google.protobuf.Timestamp`` [ns since the epoch]."""
    return {"seconds": at_ns // 10**9, "nanos": at_ns % 10**9}


def _set_type(field: FieldDescriptorProto, kind: str) -> None:
    repeated = kind.endswith("[]")
    name = kind.removesuffix("[]")
    field.label = (
        FieldDescriptorProto.LABEL_REPEATED if repeated else FieldDescriptorProto.LABEL_OPTIONAL
    )
    if name in _TYPES:
        field.type = _TYPES[name]
        return
    enumerated = name.endswith(".Level")
    field.type = FieldDescriptorProto.TYPE_ENUM if enumerated else FieldDescriptorProto.TYPE_MESSAGE
    field.type_name = name
