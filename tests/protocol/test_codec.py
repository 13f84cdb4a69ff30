"""The decode door: whatever comes in, a valid message or one ProtocolError comes out."""

import contextlib
import math
import random
import string
import struct
from typing import Any

import msgpack
import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import inspect

from shearline.protocol.codec import (
    BULK,
    BULK_BYTES_MAX,
    CONTROL_BYTES_MAX,
    FROM_OPERATOR,
    TO_EVALUATOR,
    TO_LEARNER,
    TO_OBSERVER,
    decode,
    encode,
    is_finite,
)
from shearline.protocol.errors import ProtocolError
from shearline.protocol.messages import (
    Ack,
    Command,
    CommandKind,
    Credit,
    EvaluatorState,
    Hello,
    Message,
    OutcomeKind,
    Result,
    TraceData,
    Trial,
    Verdict,
    Welcome,
)
from shearline.protocol.task import TaskSpec

KINDS = (*TO_LEARNER, *TO_EVALUATOR, *TO_OBSERVER)
TRIAL = Trial(
    boot="boot-0001",
    epoch=2,
    trial=37,
    episode=1,
    attempt=1,
    token="token-000037",
    theta=[0.5, -1.25, 3.0],
    seed=2**63 - 1,
    lease_s=2.0,
    deadline_s=60.0,
)
RESULT = Result(
    boot="boot-0001", token="token-000037", trial=37, kind=OutcomeKind.SUCCESS, cost=2.5, seed=1
)

# -- strategies from the message types themselves ----------------------------------------------

PLAIN = string.ascii_letters + string.digits


def _text(info: inspect.StrType) -> st.SearchStrategy[str]:
    low, high = info.min_length or 0, min(info.max_length or 40, 40)
    if info.pattern is None:
        return st.text(min_size=low, max_size=high)
    alphabet = PLAIN if "." in info.pattern else PLAIN + "_-"
    return st.text(alphabet, min_size=max(low, 1), max_size=high)


def _float(info: inspect.FloatType) -> st.SearchStrategy[float]:
    low = info.ge if info.ge is not None else info.gt
    return st.floats(low, info.le, allow_nan=False, allow_infinity=False).filter(
        lambda x: info.gt is None or x > info.gt
    )


def _strategy(info: Any) -> st.SearchStrategy[Any]:  # noqa: C901, PLR0911 - one case a type
    match info:
        case inspect.StrType():
            return _text(info)
        case inspect.FloatType():
            return _float(info)
        case inspect.IntType(ge=low, le=high):
            return st.integers(low, high)
        case inspect.BoolType():
            return st.booleans()
        case inspect.NoneType():
            return st.none()
        case inspect.BytesType():
            return st.binary(max_size=40)
        case inspect.EnumType(cls=cls):
            return st.sampled_from(cls)
        case inspect.ListType(item_type=item):
            most = min(4, info.max_length or 4)
            return st.lists(_strategy(item), min_size=info.min_length or 0, max_size=most)
        case inspect.DictType(key_type=key, value_type=value):
            return st.dictionaries(
                _strategy(key), _strategy(value), min_size=info.min_length or 0, max_size=4
            )
        case inspect.TupleType(item_types=items):
            return st.tuples(*map(_strategy, items))
        case inspect.UnionType(types=types):
            return st.one_of(*map(_strategy, types))
        case inspect.StructType(cls=cls, fields=fields) if cls is not TraceData:
            return st.builds(cls, **{f.name: _strategy(f.type) for f in fields})
    assert info.cls is TraceData, info
    return _traces()


@st.composite
def _traces(draw: st.DrawFn) -> TraceData:
    samples, names = draw(st.integers(0, 5)), draw(st.lists(st.text(max_size=5), max_size=3))
    size = 4 * samples * len(names)
    return TraceData(
        trial=draw(st.integers(0, 2**62)),
        token="token-01",
        samples=samples,
        names=names,
        units=["m"] * len(names),
        data=draw(st.binary(min_size=size, max_size=size)),
        events=[(0.5, "contact")],
    )


def messages(*kinds: type[Message]) -> st.SearchStrategy[Message]:
    return st.one_of([_strategy(inspect.type_info(kind)) for kind in kinds])


# -- what is valid passes -------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_kind_of_message_survives_the_wire_and_reads_as_plain_msgpack(
    kind: type[Message],
) -> None:
    @settings(max_examples=25, deadline=None)
    @given(messages(kind))
    def survives(message: Message) -> None:
        data = encode(message)
        assert decode(data, *KINDS) == message
        plain = msgpack.unpackb(data)
        assert plain["type"] == kind.__struct_config__.tag
        left_out = set(kind.__struct_fields__) - set(plain)
        assert set(plain) <= {"type", *kind.__struct_fields__}
        assert not left_out or kind.__struct_config__.omit_defaults
        assert decode(msgpack.packb(plain), kind) == message

    survives()


def test_every_message_type_is_in_one_of_the_directions() -> None:
    # Other modules may derive messages of their own; those are no business of the wire's.
    ours = {
        kind
        for kind in Message.__subclasses__()
        if kind.__module__ in {"shearline.protocol.messages", "shearline.protocol.scene"}
    }
    assert {*KINDS, *FROM_OPERATOR} == ours


def test_fields_with_defaults_may_be_left_out_and_unknown_ones_are_ignored() -> None:
    data = msgpack.packb({"type": "command", "kind": "hold", "colour": [1, {"a": b"\0"}]})
    assert decode(data, Command) == Command(kind=CommandKind.HOLD)


def test_the_tag_may_stand_anywhere_and_whole_numbers_count_as_floats() -> None:
    plain = msgpack.unpackb(encode(TRIAL))
    plain = dict(reversed(plain.items())) | {"theta": [1, 2, 3]}
    trial = decode(msgpack.packb(plain), *TO_EVALUATOR)
    assert isinstance(trial, Trial)
    assert trial.theta == [1.0, 2.0, 3.0]


def test_of_a_key_that_comes_twice_the_last_one_counts() -> None:
    data = b"\x83\xa4type\xa7command\xa4kind\xa4stop\xa4kind\xa4hold"
    assert decode(data, Command) == Command(kind=CommandKind.HOLD)


# -- what is not, does not ---------------------------------------------------------------------


def _with(**changes: object) -> bytes:
    data: bytes = msgpack.packb(msgpack.unpackb(encode(TRIAL)) | changes)
    return data


DEEP = b"\x91" * 60_000 + b"\xc0"
HOSTILE = {
    "nothing": b"",
    "never used opcode": b"\xc1",
    "trailing byte": encode(TRIAL) + b"\0",
    "truncated": encode(TRIAL)[:-1],
    "not a map": msgpack.packb([1, 2]),
    "no kind": msgpack.packb({"kind": "stop"}),
    "empty kind": msgpack.packb({"type": ""}),
    "number as kind": _with(type=5),
    "unknown kind": _with(type="x" * 5000),
    "other direction": encode(RESULT),
    "two kinds": b"\x83\xa4type\xa7command\xa4type\xa5trial\xa4kind\xa4hold",
    "missing field": msgpack.packb({"type": "trial", "boot": "boot-0001"}),
    "bool as number": _with(seed=True),
    "text as number": _with(seed="1"),
    "float as whole number": _with(seed=1.5),
    "negative": _with(seed=-1),
    "too large a seed": _with(seed=2**63),
    "text as tuple": _with(theta="abc"),
    "empty tuple": _with(theta=[]),
    "too long a tuple": _with(theta=[0.0] * 1025),
    "nested tuple": _with(theta=[[0.0]]),
    "extension": _with(theta=msgpack.ExtType(5, b"x")),
    "timestamp": _with(lease_s=msgpack.Timestamp(1)),
    "short token": _with(token="token-1"),
    "long token": _with(token="t" * 65),
    "invalid UTF-8": b"\x82\xa4type\xa7command\xa4kind\xa4\xff\xfe\xfd\xfc",
    "invalid UTF-8 in an unknown key": b"\x82\xa4type\xa7command\xa4\xff\xfe\xfd\xfc\xc0",
    "deep": DEEP,
    "deep in an unknown field": b"\x82\xa4type\xa5trial\xa1x" + DEEP,
    "array of 4 G": b"\x82\xa4type\xa5trial\xa5theta\xdd\xff\xff\xff\xff",
    "unknown array of 4 G": b"\x82\xa4type\xa5trial\xa1x\xdd\xff\xff\xff\xff",
    "bytes of 4 G": b"\x82\xa4type\xa5trial\xa5theta\xc6\xff\xff\xff\xff",
    "text of 4 G": b"\x82\xa4type\xa5trial\xa5token\xdb\xff\xff\xff\xff",
    "map of 4 G": b"\xdf\xff\xff\xff\xff\xa4type\xa5trial",
    "NaN": _with(lease_s=math.nan),
    "infinity": _with(deadline_s=math.inf),
    "NaN in a tuple": _with(theta=[0.0, math.nan]),
    "infinity as float32": encode(TRIAL).replace(
        struct.pack(">Bd", 0xCB, 0.5), b"\xca\x7f\x80\0\0"
    ),
    "too many bytes": encode(TRIAL) + b"\0" * CONTROL_BYTES_MAX,
}


@pytest.mark.parametrize("data", HOSTILE.values(), ids=HOSTILE.keys())
def test_hostile_bytes_become_one_short_sentence(data: bytes) -> None:
    with pytest.raises(ProtocolError) as caught:
        decode(data, *TO_EVALUATOR)
    assert len(str(caught.value)) < 400
    assert str(caught.value).isprintable()


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=200))
def test_arbitrary_bytes_are_a_message_or_a_protocol_error(data: bytes) -> None:
    with contextlib.suppress(ProtocolError):
        assert isinstance(decode(data, *KINDS), Message)


def _mutate(data: bytes, rng: random.Random) -> bytes:
    mutant = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(mutant)) if mutant else 0
        match rng.randrange(5):
            case 0 if mutant:
                mutant[at] = rng.randrange(256)
            case 1 if mutant:
                mutant[at] ^= 1 << rng.randrange(8)
            case 2:
                del mutant[at : at + rng.randint(1, 8)]
            case 3:
                mutant[at:at] = rng.randbytes(rng.randint(1, 4))
            case _:
                mutant[at:at] = mutant[at : at + rng.randint(1, 16)]
    return bytes(mutant)


def _corpus() -> list[bytes]:
    task = TaskSpec(name="keylock", space={"push": ("N", 0.0, 20.0)}, options={"level": "limit"})
    return [
        encode(message)
        for message in (
            TRIAL,
            RESULT,
            Hello(boot="boot-0001", version=1, task_digest="", kind="robot", engine="", credits=2),
            Credit(boot="boot-0001", seq=3, credits=2),
            Welcome(boot="boot-0001", epoch=1, task=task, lease_s=2.0),
            Ack(boot="boot-0001", token="token-01", verdict=Verdict.COUNTED),
            EvaluatorState(evaluator="lab-1", state="ready"),
            TraceData(
                trial=1, token="token-01", samples=2, names=["t_s"], units=["s"], data=b"\0" * 8
            ),
        )
    ]


def test_twenty_thousand_mutants_give_a_finite_message_or_a_protocol_error() -> None:
    rng, corpus, passed = random.Random(20), _corpus(), 0
    for _ in range(20_000):
        mutant = _mutate(rng.choice(corpus), rng)
        try:
            message = decode(mutant, *KINDS)
        except ProtocolError:
            continue
        passed += 1
        assert is_finite(message)
        assert decode(encode(message), *KINDS) == message
    assert 100 < passed < 19_900


# -- what we send --------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_never_sent(number: float) -> None:
    for message in (
        msgspec.structs.replace(RESULT, cost=number),
        msgspec.structs.replace(RESULT, extras={"depth_m": number}),
        msgspec.structs.replace(TRIAL, theta=[0.0, number]),
    ):
        with pytest.raises(ValueError, match="NaN or infinite number"):
            encode(message)


def test_finite_numbers_whose_sum_is_not_are_sent() -> None:
    message = msgspec.structs.replace(TRIAL, theta=[1e308, 1e308])
    assert decode(encode(message), Trial) == message


def test_a_whole_number_too_large_for_a_float_is_malformed() -> None:
    with pytest.raises(ValueError, match="malformed"):
        encode(msgspec.structs.replace(RESULT, cost=10**400))


@pytest.mark.parametrize(
    "message",
    [
        msgspec.structs.replace(RESULT, why="x" * 3000),
        msgspec.structs.replace(RESULT, why="\ud800"),
        msgspec.structs.replace(RESULT, seed=2**70),
        msgspec.structs.replace(RESULT, trial=-1),
        msgspec.structs.replace(RESULT, extras={"what": object()}),
        msgspec.structs.replace(RESULT, token="short"),
    ],
)
def test_a_message_that_every_peer_would_refuse_is_never_sent(message: Message) -> None:
    with pytest.raises(ValueError, match="malformed"):
        encode(message)


def test_a_control_message_beyond_the_cap_is_never_sent() -> None:
    space = {f"{'p' * 80}{i}": ("N m/rad", 0.0, 1.0) for i in range(1024)}
    welcome = Welcome(boot="boot-0001", epoch=1, task=TaskSpec(name="t", space=space), lease_s=2.0)
    with pytest.raises(ValueError, match="more than 65536"):
        encode(welcome)


def test_a_control_message_may_not_be_as_large_as_a_bulk_one_that_comes_by_the_same_door() -> None:
    padded = msgpack.packb({"type": "command", "kind": "hold", "x": b"\0" * CONTROL_BYTES_MAX})
    with pytest.raises(ProtocolError, match="at most 65536"):
        decode(padded, Command, TraceData)


def test_bulk_fits_where_it_is_expected_up_to_its_own_cap() -> None:
    samples = 100_000
    trace = TraceData(
        trial=0,
        token="token-01",
        samples=samples,
        names=["t_s", "x"],
        units=["s", "m"],
        data=bytes(8 * samples),
    )
    assert decode(encode(trace), *BULK) == trace
    with pytest.raises(ProtocolError, match="at most"):
        decode(bytes(BULK_BYTES_MAX + 1), *BULK)


def test_columns_of_a_trace_that_do_not_fit_together_are_refused() -> None:
    trace = {"type": "trace", "trial": 0, "token": "token-01", "samples": 3}
    columns = {"names": ["t_s"], "units": ["s"], "data": bytes(8)}
    with pytest.raises(ProtocolError, match="12 bytes"):
        decode(msgpack.packb(trace | columns), TraceData)
    with pytest.raises(ProtocolError, match="2 units"):
        decode(msgpack.packb(trace | columns | {"samples": 2, "units": ["s", "m"]}), TraceData)


def test_asking_for_no_kind_at_all_is_a_mistake_of_the_caller() -> None:
    with pytest.raises(TypeError, match="at least one"):
        decode(b"\x80")


@given(st.recursive(st.floats() | st.integers(), lambda inner: st.lists(inner, max_size=4)))
def test_a_value_is_finite_when_every_float_in_it_is(value: object) -> None:
    def flat(v: object) -> list[object]:
        return [x for item in v for x in flat(item)] if isinstance(v, list) else [v]

    assert is_finite({"a": (value,)}) == all(
        math.isfinite(x) for x in flat(value) if isinstance(x, float)
    )
