"""Protobuf types built from the message types, so that one definition serves wire and record.

Each struct becomes one proto3 message: fields numbered in their order (fields are only ever
added at the end), integers as ``int64``, floats as ``double``, enums as their text, ``X | None``
as ``optional``, mappings as ``map``. Columns of a trace, ``bytes`` on the wire, are published
as packed ``repeated float``: the same bytes, readable as numbers by anyone. Nothing here knows
about files.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any

import msgspec
from google.protobuf import timestamp_pb2
from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessageClass
from msgspec import inspect

from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Message
from shearline.record.foxglove import foxglove_file
from shearline.record.topics import TOPICS

PACKAGE = "shearline"
#: Little-endian float32 on the wire: identical to a packed ``repeated float``.
FLOAT_COLUMNS = frozenset({(f"{PACKAGE}.TraceData", "data")})

_SCALARS: dict[type[inspect.Type], int] = {
    inspect.IntType: FieldDescriptorProto.TYPE_INT64,
    inspect.FloatType: FieldDescriptorProto.TYPE_DOUBLE,
    inspect.StrType: FieldDescriptorProto.TYPE_STRING,
    inspect.EnumType: FieldDescriptorProto.TYPE_STRING,
    inspect.BoolType: FieldDescriptorProto.TYPE_BOOL,
    inspect.BytesType: FieldDescriptorProto.TYPE_BYTES,
}


def file_set(schema: str) -> bytes:
    """Return the serialised ``FileDescriptorSet`` that describes one type completely.

    Args:
        schema: Full name, e.g. ``"shearline.Counted"`` or ``"foxglove.Log"``.

    Raises:
        RecordError: If no such type is recorded.
    """
    if schema.startswith("foxglove."):
        time = FileDescriptorProto()
        timestamp_pb2.DESCRIPTOR.CopyToProto(time)
        return bytes(FileDescriptorSet(file=[time, foxglove_file()]).SerializeToString())
    kind = _kinds().get(schema)
    if kind is None:
        raise RecordError(f"no recorded type {schema!r}: expected one of {', '.join(_kinds())}")
    return bytes(FileDescriptorSet(file=[_published(_file(kind))]).SerializeToString())


def encode(message: Message) -> bytes:
    """Return the protobuf bytes of one message.

    Raises:
        RecordError: If its type is not recorded.
    """
    kind = type(message)
    if kind not in TOPICS:
        raise RecordError(f"messages of type {kind.__name__} are not recorded")
    return bytes(_encoder(kind)(**_fields(message)).SerializeToString())


def encode_standard(schema: str, values: Mapping[str, Any]) -> bytes:
    """Return the protobuf bytes of a standard type from nested plain values.

    Args:
        schema: Full name, e.g. ``"foxglove.Log"``.
        values: Field name to value; a nested mapping for a nested message.
    """
    return bytes(_standard(schema)(**values).SerializeToString())


class Decoder:
    """Turns protobuf bytes back into messages by the descriptors of the file they came from.

    A record made by another version may lack fields (their defaults are used) or have more
    (they are left out).

    Args:
        schema: Full name of the type.
        descriptors: The file's serialised ``FileDescriptorSet``.

    Raises:
        RecordError: If the descriptors are damaged or the type is unknown here.
    """

    def __init__(self, schema: str, descriptors: bytes) -> None:
        kind = _kinds().get(schema)
        if kind is None:
            raise RecordError(f"no recorded type {schema!r}: expected one of {', '.join(_kinds())}")
        self._kind = kind
        try:
            files = FileDescriptorSet.FromString(descriptors).file
            self._class = _message_class([_internal(file) for file in files], schema)
        except (DecodeError, TypeError, KeyError) as error:
            raise RecordError(f"the schema of {schema} cannot be read: {error}") from error

    def __call__(self, data: bytes) -> Any:
        """Decode one message.

        Raises:
            RecordError: If the bytes are not of this type.
        """
        try:
            return msgspec.convert(_plain(self._class.FromString(data)), self._kind)
        except (DecodeError, msgspec.ValidationError) as error:
            raise RecordError(f"a {self._kind.__name__} on record is damaged: {error}") from error


# -- from struct to descriptor ------------------------------------------------------------------


def _file(kind: type[Message]) -> FileDescriptorProto:
    file = FileDescriptorProto(
        name=f"{PACKAGE}/{kind.__name__}.proto", package=PACKAGE, syntax="proto3"
    )
    info = inspect.type_info(kind)
    assert isinstance(info, inspect.StructType)
    _add_struct(file, info, set())
    return file


def _add_struct(file: FileDescriptorProto, info: inspect.StructType, done: set[str]) -> None:
    done.add(info.cls.__name__)
    proto = file.message_type.add(name=info.cls.__name__)
    for number, field in enumerate(info.fields, start=1):
        added = proto.field.add(
            name=field.name, number=number, label=FieldDescriptorProto.LABEL_OPTIONAL
        )
        for struct in _fill(proto, added, field.type):
            if struct.cls.__name__ not in done:
                _add_struct(file, struct, done)


def _fill(
    proto: DescriptorProto, field: FieldDescriptorProto, kind: inspect.Type
) -> list[inspect.StructType]:
    """Set the type of one field; return the structs that it refers to."""
    match kind:
        case inspect.UnionType(types=types):
            (inner,) = (t for t in types if not isinstance(t, inspect.NoneType))
            field.proto3_optional = True
            field.oneof_index = len(proto.oneof_decl)
            proto.oneof_decl.add(name=f"_{field.name}")
            return _fill(proto, field, inner)
        case inspect.ListType(item_type=item):
            field.label = FieldDescriptorProto.LABEL_REPEATED
            return _fill(proto, field, item)
        case inspect.TupleType(item_types=items):
            return _fill_nested(proto, field, [(f"item_{i}", item) for i, item in enumerate(items)])
        case inspect.DictType(key_type=key, value_type=value):
            field.label = FieldDescriptorProto.LABEL_REPEATED
            found = _fill_nested(proto, field, [("key", key), ("value", value)])
            proto.nested_type[-1].options.map_entry = True
            return found
        case inspect.StructType(cls=cls):
            field.type = FieldDescriptorProto.TYPE_MESSAGE
            field.type_name = f".{PACKAGE}.{cls.__name__}"
            return [kind]
    field.type = _SCALARS[type(kind)]  # type: ignore[assignment] # an enum's values are ints
    return []


def _fill_nested(
    proto: DescriptorProto, field: FieldDescriptorProto, items: list[tuple[str, inspect.Type]]
) -> list[inspect.StructType]:
    # protobuf wants exactly this spelling for the entry of a map
    entry = proto.nested_type.add(name="".join(map(str.title, field.name.split("_"))) + "Entry")
    field.type = FieldDescriptorProto.TYPE_MESSAGE
    field.type_name = f".{PACKAGE}.{proto.name}.{entry.name}"
    found: list[inspect.StructType] = []
    for number, (name, kind) in enumerate(items, start=1):
        added = entry.field.add(name=name, number=number, label=FieldDescriptorProto.LABEL_OPTIONAL)
        found += _fill(entry, added, kind)
    return found


def _published(file: FileDescriptorProto) -> FileDescriptorProto:
    for field in _float_columns(file):
        field.type = FieldDescriptorProto.TYPE_FLOAT
        field.label = FieldDescriptorProto.LABEL_REPEATED
    return file


def _internal(file: FileDescriptorProto) -> FileDescriptorProto:
    for field in _float_columns(file):
        field.type = FieldDescriptorProto.TYPE_BYTES
        field.label = FieldDescriptorProto.LABEL_OPTIONAL
    return file


def _float_columns(file: FileDescriptorProto) -> list[FieldDescriptorProto]:
    return [
        field
        for message in file.message_type
        for field in message.field
        if (f"{file.package}.{message.name}", field.name) in FLOAT_COLUMNS
    ]


# -- from values to protobuf and back -----------------------------------------------------------


@functools.cache
def _kinds() -> dict[str, type[Message]]:
    return {topic.schema: kind for kind, topic in TOPICS.items()}


@functools.cache
def _encoder(kind: type[Message]) -> type[Any]:
    return _message_class([_file(kind)], TOPICS[kind].schema)


@functools.cache
def _standard(schema: str) -> type[Any]:
    files = FileDescriptorSet.FromString(file_set(schema)).file
    return _message_class(files, schema)


def _message_class(files: Iterable[FileDescriptorProto], schema: str) -> type[Any]:
    pool = DescriptorPool()
    for file in files:
        pool.Add(file)
    found: type[Any] = GetMessageClass(pool.FindMessageTypeByName(schema))
    return found


def _fields(struct: msgspec.Struct) -> dict[str, Any]:
    values = msgspec.structs.asdict(struct)
    return {name: _to_proto(value) for name, value in values.items() if value is not None}


def _to_proto(value: Any) -> Any:
    match value:
        case msgspec.Struct():
            return _fields(value)
        case tuple():
            return {f"item_{i}": item for i, item in enumerate(value)}
        case list() if value and isinstance(value[0], (msgspec.Struct, tuple)):
            return [_to_proto(item) for item in value]
    return value


def _plain(proto: Any) -> dict[str, Any]:
    """Return the fields of one parsed message as plain values; unset optional ones as None."""
    return {field.name: _plain_field(proto, field) for field in proto.DESCRIPTOR.fields}


def _plain_field(proto: Any, field: Any) -> Any:
    value = getattr(proto, field.name)
    if field.message_type is None:
        if field.has_presence and not proto.HasField(field.name):
            return None
        return list(value) if field.is_repeated else value
    if field.message_type.GetOptions().map_entry:
        return dict(value)
    if field.is_repeated:
        return [_plain_message(item) for item in value]
    return _plain_message(value) if proto.HasField(field.name) else None


def _plain_message(proto: Any) -> Any:
    values = _plain(proto)
    return tuple(values.values()) if "item_0" in values else values
