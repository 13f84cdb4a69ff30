"""The one door between bytes and messages: every foreign byte passes here and nowhere else.

The order is the point: a size cap before anything is parsed, a typed decode that refuses what the
message types do not allow, then a walk that refuses NaN and infinity. Whatever is wrong comes out
as one :class:`~shearline.protocol.errors.ProtocolError`. The door does not know keys, sessions or
who sent what; it never looks into the float32 columns of a trace.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cache
from operator import attrgetter
from typing import Any, TypeVar, Union

import msgspec
import msgspec.inspect

from shearline.protocol.errors import ProtocolError
from shearline.protocol.messages import (
    Ack,
    Bye,
    Command,
    Counted,
    Credit,
    EpisodeClosed,
    EvaluatorState,
    Hello,
    Message,
    Proposed,
    Refused,
    Renew,
    Result,
    Snapshot,
    Status,
    TraceData,
    Trial,
    Welcome,
    Wire,
)
from shearline.protocol.scene import SceneData

M = TypeVar("M", bound=Message)

#: A trial of 1024 parameters takes 9 KiB, a welcome with 1024 named bounds about 40 KiB.
CONTROL_BYTES_MAX = 64 * 1024

#: A trace of 60 s at 1 kHz with 32 columns takes 7.7 MB.
BULK_BYTES_MAX = 8 * 1024 * 1024

#: Kinds that may be larger than a control message; all of them travel on observer keys only.
BULK: frozenset[type[Message]] = frozenset({SceneData, Snapshot, Status, TraceData, Wire})

#: What a learner reads from evaluators, what an evaluator reads from the learner, and so on.
TO_LEARNER: tuple[type[Message], ...] = (Hello, Credit, Renew, Result, Bye)
TO_EVALUATOR: tuple[type[Message], ...] = (Welcome, Refused, Trial, Ack, Command)
FROM_OPERATOR: tuple[type[Message], ...] = (Command,)
TO_OBSERVER: tuple[type[Message], ...] = (
    Proposed,
    Counted,
    EpisodeClosed,
    EvaluatorState,
    Snapshot,
    Status,
    SceneData,
    TraceData,
    Wire,
)

#: Kinds that the learner alone makes, of nothing but what had passed this door or the space's own
#: checks: to read them back before they are sent would only cost every trial as much again.
MADE_OF_CHECKED: frozenset[type[Message]] = frozenset({Trial, Ack})

#: What may come on each topic of :mod:`shearline.protocol.keys`.
BY_TOPIC: Mapping[str, tuple[type[Message], ...]] = {
    **{str(kind.__struct_config__.tag): (kind,) for kind in TO_LEARNER},
    "trial": (Trial,),
    "ack": (Ack,),
    "cmd": (Welcome, Refused, Command),
    "all/cmd": (Command,),
    "op/cmd": FROM_OPERATOR,
}

#: Enough of a foreign sentence to find the mistake, too little to fill a log.
_REASON_CHARS_MAX = 200

#: What msgspec raises for bytes that are not the message they claim to be. A ValidationError is a
#: DecodeError; RecursionError comes from deep nesting in an unknown field.
_FOREIGN_FAULTS = (
    msgspec.DecodeError,
    UnicodeDecodeError,
    RecursionError,
    OverflowError,
    MemoryError,
)


class _Nothing(Message, frozen=True, kw_only=True, tag=""):
    """The second kind beside a single one; nobody may send it."""


_WITHOUT_FLOAT = frozenset(
    {
        msgspec.inspect.StrType,
        msgspec.inspect.IntType,
        msgspec.inspect.BoolType,
        msgspec.inspect.BytesType,
        msgspec.inspect.NoneType,
        msgspec.inspect.EnumType,
    }
)

_encoder = msgspec.msgpack.Encoder()


def decode(data: bytes, *kinds: type[M]) -> M:
    """Read one message of the given kinds from msgpack.

    Args:
        data: One whole message.
        kinds: The message types that may come here, e.g. :data:`TO_LEARNER`.

    Raises:
        ProtocolError: If the bytes are too many, malformed, or of no admitted kind.
    """
    limit, decoder = _door(kinds)
    if len(data) > limit:
        raise ProtocolError(f"expected at most {limit} bytes, got {len(data)}: message refused")
    try:
        message: M = decoder.decode(data)
    except _FOREIGN_FAULTS as fault:
        raise ProtocolError(f"expected {_names(kinds)}, got {_reason(fault)}") from None
    if isinstance(message, _Nothing):
        raise ProtocolError(f"expected {_names(kinds)}, got a message without a kind")
    if len(data) > CONTROL_BYTES_MAX and type(message) not in BULK:
        raise ProtocolError(
            f"expected at most {bytes_max(type(message))} bytes of {_names((type(message),))},"
            f" got {len(data)}: message refused"
        )
    if not is_finite(message):
        raise ProtocolError(
            f"expected finite numbers in {_names((type(message),))}, got NaN or infinity"
        )
    return message


def encode(message: Message) -> bytes:
    """Write one message as a msgpack map whose ``"type"`` names it.

    What is written passes :func:`decode`: a message that every peer would silently drop is a
    mistake of this program and is found here, not by a result that is sent again for ever.

    Raises:
        ValueError: If a number is not finite, a field breaks its type, or it is too large.
    """
    kind = type(message)
    if not is_finite(message):
        raise ValueError(f"a {_names((kind,))} to send has a NaN or infinite number: {message!r}")
    try:
        data = _encoder.encode(message)
        if kind not in MADE_OF_CHECKED:
            _door((kind,))[1].decode(data)
    except (msgspec.MsgspecError, UnicodeError, OverflowError, TypeError) as fault:
        raise ValueError(f"a {_names((kind,))} to send is malformed: {_reason(fault)}") from fault
    if len(data) > bytes_max(kind):
        raise ValueError(
            f"a {_names((kind,))} to send has {len(data)} bytes, more than {bytes_max(kind)}"
        )
    return data


def bytes_max(kind: type[Message]) -> int:
    """Return the largest encoded size of one kind of message [bytes]."""
    return BULK_BYTES_MAX if kind in BULK else CONTROL_BYTES_MAX


def is_finite(value: object) -> bool:
    """Tell whether no float anywhere in a message or plain value is NaN or infinite."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, msgspec.Struct):
        return _struct_is_finite(value)
    if isinstance(value, list | tuple):
        return _all_finite(value)
    if isinstance(value, dict):
        return _all_finite(value.values())
    return True


def _struct_is_finite(value: msgspec.Struct) -> bool:
    flat, deep = _floating(type(value))
    try:
        for floats in flat:
            # This walk is in every round trip, twice. A sum is finite only if all of it is, and is
            # had in half of the time; one that overflows leaves it open.
            if not math.isfinite(sum(floats(value))) and not all(map(math.isfinite, floats(value))):
                return False
    except (TypeError, OverflowError):  # no float in place of one: the encoder will say so
        return True
    return not deep or all(is_finite(getattr(value, name)) for name in deep)


def _all_finite(values: Collection[Any]) -> bool:
    try:
        return all(map(math.isfinite, values))
    except TypeError:
        return all(map(is_finite, values))


@cache
def _floating(
    kind: type[msgspec.Struct],
) -> tuple[tuple[Callable[[Any], Iterable[float]], ...], tuple[str, ...]]:
    """Return how to get the floats of a kind of message, and the fields where they are deeper."""
    info = msgspec.inspect.type_info(kind)
    assert isinstance(info, msgspec.inspect.StructType)
    plain: list[str] = []
    flat: list[Callable[[Any], Iterable[float]]] = []
    deep: list[str] = []
    for field in info.fields:
        match field.type:
            case msgspec.inspect.FloatType():
                plain.append(field.name)
            case msgspec.inspect.ListType(item_type=msgspec.inspect.FloatType()):
                flat.append(attrgetter(field.name))
            case msgspec.inspect.DictType(value_type=msgspec.inspect.FloatType()):
                flat.append(_values_of(field.name))
            case other if _holds_float(other):
                deep.append(field.name)
    if plain:
        flat.append(attrgetter(*plain, plain[0]))  # of a single name it would be no tuple
    return tuple(flat), tuple(deep)


def _values_of(name: str) -> Callable[[Any], Iterable[float]]:
    def values(message: Any) -> Iterable[float]:
        found: dict[str, float] = getattr(message, name)
        return found.values()

    return values


def _holds_float(info: msgspec.inspect.Type) -> bool:
    match info:
        case msgspec.inspect.StructType(cls=kind):
            return _floating(kind) != ((), ())
        case msgspec.inspect.TupleType(item_types=inners) | msgspec.inspect.UnionType(types=inners):
            return any(map(_holds_float, inners))
        case msgspec.inspect.ListType(item_type=inner) | msgspec.inspect.DictType(value_type=inner):
            return _holds_float(inner)
    return type(info) not in _WITHOUT_FLOAT


@cache
def _door(kinds: tuple[type[Message], ...]) -> tuple[int, msgspec.msgpack.Decoder[Any]]:
    if not kinds:
        raise TypeError("decode() needs at least one kind of message")
    # Alone, a tagged struct is decoded without its tag; as one of two, never.
    decoder = msgspec.msgpack.Decoder(Union[(*kinds, _Nothing)])
    return max(map(bytes_max, kinds)), decoder


@cache
def _names(kinds: tuple[type[Message], ...]) -> str:
    return " or ".join(str(kind.__struct_config__.tag) for kind in kinds)


def _reason(fault: BaseException) -> str:
    text = " ".join(str(fault).split()) or type(fault).__name__
    printable = "".join(c if c.isprintable() else "?" for c in text)
    short = printable[:_REASON_CHARS_MAX]
    return short if short == printable else short + "..."
