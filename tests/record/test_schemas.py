"""One definition serves wire and record: whatever goes in as a message comes out as the same."""

import struct
from collections.abc import Callable
from random import Random
from typing import Any, cast

import msgspec
import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorSet
from hypothesis import given
from hypothesis import strategies as st
from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory
from msgspec import inspect

from shearline.protocol.errors import RecordError
from shearline.protocol.messages import EpisodeClosed, Hello, Message, Proposed, TraceData
from shearline.record.schemas import Decoder, encode, encode_standard, file_set
from shearline.record.topics import STANDARD, TOPICS

TEXTS = ("", "a", "naïve \u2603", "x" * 40, "line\nline", "\x00")
NUMBERS = (0.0, -0.0, 1.5, 1e300, 5e-324, 0.1, 2.0**53 + 2.0)


def a_text(kind: inspect.StrType, r: Random) -> str:
    if kind.pattern:
        return r.choice(("token-01", "sim-0000", "Z9_-abcd", "x" * 64))
    text = r.choice(TEXTS)
    return (text + "0" * max(0, (kind.min_length or 0) - len(text)))[: kind.max_length]


def a_number(kind: inspect.FloatType, r: Random) -> float:
    value = r.choice((*NUMBERS, r.uniform(0.0, 1e6)))
    return value if kind.ge is not None else r.choice((value, -value))


def some(kind: inspect.Type, r: Random, least: int, most: int = 1024) -> list[Any]:
    return [a_value(kind, r) for _ in range(r.randint(least, min(least + 3, most)))]


#: How to make a value that a field admits, by the kind of its type.
MAKERS: dict[type[inspect.Type], Callable[[Any, Random], Any]] = {
    inspect.UnionType: lambda kind, r: a_value(r.choice(kind.types), r),
    inspect.NoneType: lambda _, __: None,
    inspect.IntType: lambda kind, r: r.choice((kind.ge, 1, r.randint(kind.ge, kind.le), kind.le)),
    inspect.FloatType: a_number,
    inspect.StrType: a_text,
    inspect.BytesType: lambda _, r: b"".join(struct.pack("<f", r.random()) for _ in range(5)),
    inspect.BoolType: lambda _, r: r.random() < 0.5,
    inspect.EnumType: lambda kind, r: r.choice(list(kind.cls)),
    inspect.ListType: lambda kind, r: some(
        kind.item_type, r, kind.min_length or 0, kind.max_length or 1024
    ),
    inspect.TupleType: lambda kind, r: tuple(a_value(item, r) for item in kind.item_types),
    inspect.DictType: lambda kind, r: dict(
        zip(some(kind.key_type, r, 0), some(kind.value_type, r, 4), strict=False)
    ),
}


def a_struct(kind: inspect.StructType, r: Random) -> Any:
    fields = {field.name: a_value(field.type, r) for field in kind.fields}
    if kind.cls is TraceData:  # its columns fit together
        columns, samples = r.randint(0, 4), r.randint(0, 5)
        fields["samples"] = samples
        fields["names"] = fields["units"] = ["c"] * columns
        fields["data"] = b"".join(struct.pack("<f", r.random()) for _ in range(columns * samples))
    return kind.cls(**fields)


MAKERS[inspect.StructType] = a_struct


def a_value(kind: inspect.Type, r: Random) -> Any:
    return MAKERS[type(kind)](kind, r)


INFOS = {kind: inspect.type_info(kind) for kind in TOPICS}
MESSAGES = st.builds(
    lambda kind, seed: cast("Message", a_value(INFOS[kind], Random(seed))),
    st.sampled_from(list(TOPICS)),
    st.integers(0, 2**32),
)


def foreign(schema: str, data: bytes) -> Any:
    """Decode as someone would who has only the file."""
    described = Schema(id=1, name=schema, encoding="protobuf", data=file_set(schema))
    decoder = DecoderFactory().decoder_for("protobuf", described)
    assert decoder is not None
    return decoder(data)


@given(MESSAGES)
def test_every_message_comes_back_as_it_went_in(message: Message) -> None:
    schema = TOPICS[type(message)].schema
    assert Decoder(schema, file_set(schema))(encode(message)) == message


@given(MESSAGES)
def test_a_foreign_reader_finds_every_field_by_its_name(message: Message) -> None:
    decoded = foreign(TOPICS[type(message)].schema, encode(message))
    for name in message.__struct_fields__:
        value, found = getattr(message, name), getattr(decoded, name)
        if isinstance(value, (bool, int, float, str)):
            assert found == value
        elif isinstance(value, (list, dict)):
            assert len(found) == len(value)


def test_the_columns_of_a_trace_read_as_numbers_without_our_code() -> None:
    columns = np.array([[0.0, 0.001], [1.5, -2.25]], dtype="<f4")
    message = TraceData(
        trial=1,
        token="a-token-1",
        samples=2,
        names=["t_s", "x"],
        units=["s", "m"],
        data=columns.tobytes(),
        events=[(0.5, "contact")],
    )
    decoded = foreign("shearline.TraceData", encode(message))
    assert list(decoded.data) == columns.ravel().tolist()
    assert (decoded.events[0].item_0, decoded.events[0].item_1) == (0.5, "contact")


def test_a_record_of_an_older_version_is_read_with_defaults() -> None:
    schema = "shearline.TraceData"
    described = FileDescriptorSet.FromString(file_set(schema))
    (kind,) = (m for m in described.file[0].message_type if m.name == "TraceData")
    (late,) = (field for field in kind.field if field.name == "events")
    kind.field.remove(late)
    message = TraceData(
        trial=4, token="a-token-4", samples=0, names=["t_s"], units=["s"], data=b"", events=[]
    )
    decoder = Decoder(schema, described.SerializeToString())
    assert decoder(encode(message)) == message


def test_a_record_of_a_newer_version_is_read_without_what_is_new() -> None:
    schema = "shearline.Proposed"
    described = FileDescriptorSet.FromString(file_set(schema))
    described.file[0].message_type[0].field.add(
        name="novelty", number=99, type=FieldDescriptorProto.TYPE_DOUBLE, label=1
    )
    message = Proposed(trial=1, episode=0, theta=[0.5], seed=3)
    tag = (99 << 3) | 1
    extra = bytes([tag & 0x7F | 0x80, tag >> 7]) + struct.pack("<d", 2.0)
    assert Decoder(schema, described.SerializeToString())(encode(message) + extra) == message


def test_what_is_not_an_observers_message_is_not_recorded() -> None:
    hello = Hello(
        boot="a-boot-1", version=1, task_digest="", kind="simulator", engine="", credits=1
    )
    with pytest.raises(RecordError, match="Hello are not recorded"):
        encode(hello)
    with pytest.raises(RecordError, match="expected one of shearline"):
        file_set("shearline.Hello")
    with pytest.raises(RecordError, match="expected one of shearline"):
        Decoder("shearline.Hello", b"")


def test_damaged_bytes_are_one_clear_error() -> None:
    schema = "shearline.EpisodeClosed"
    with pytest.raises(RecordError, match="EpisodeClosed on record is damaged"):
        Decoder(schema, file_set(schema))(b"\xff\xff\xff")
    with pytest.raises(RecordError, match=r"schema of shearline\.EpisodeClosed cannot be read"):
        Decoder(schema, b"\x00garbage")


def test_a_value_that_the_message_forbids_is_damage_too() -> None:
    schema = "shearline.EpisodeClosed"
    message = EpisodeClosed(
        episode=0, trials=1, successes=1, success_rate=1.0, mean_cost=None, best_cost=None, at_s=1.0
    )
    data = encode(msgspec.structs.replace(message, at_s=-1.0))
    with pytest.raises(RecordError, match="damaged"):
        Decoder(schema, file_set(schema))(data)


@pytest.mark.parametrize("topic", STANDARD)
def test_standard_types_carry_their_published_numbers(topic: Any) -> None:
    # as published by Foxglove, checked once against its own SDK 0.30.3
    published = {
        "foxglove.Log": {
            "timestamp": 1, "level": 2, "message": 3, "name": 4, "file": 5, "line": 6
        },
        "foxglove.PosesInFrame": {"timestamp": 1, "frame_id": 2, "poses": 3},
        "foxglove.SceneUpdate": {"entities": 2},
        "foxglove.SceneEntity": {
            "timestamp": 1, "frame_id": 2, "id": 3, "frame_locked": 5,
            "arrows": 7, "cubes": 8, "spheres": 9, "cylinders": 10,
        },
        "foxglove.CylinderPrimitive": {
            "pose": 1, "size": 2, "bottom_scale": 3, "top_scale": 4, "color": 5
        },
        "foxglove.FrameTransforms": {"transforms": 1},
        "foxglove.FrameTransform": {
            "timestamp": 1, "parent_frame_id": 2, "child_frame_id": 3,
            "translation": 4, "rotation": 5,
        },
    }  # fmt: skip
    files = FileDescriptorSet.FromString(file_set(topic.schema)).file
    described = {
        f"{file.package}.{message.name}": {field.name: field.number for field in message.field}
        for file in files
        for message in file.message_type
    }
    assert topic.schema in published
    assert published.items() <= described.items()


def test_a_log_line_is_a_foxglove_log() -> None:
    values = {"level": 3, "message": "slow disk", "timestamp": {"seconds": 5, "nanos": 7}}
    decoded = foreign("foxglove.Log", encode_standard("foxglove.Log", values))
    assert (decoded.level, decoded.message) == (3, "slow disk")
    assert (decoded.timestamp.seconds, decoded.timestamp.nanos) == (5, 7)
