"""What reaches the learner: bytes on keys become events, or are counted as malformed."""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from shearline.learner.dispatcher.events import (
    ByeReceived,
    CreditReceived,
    EvaluatorGone,
    Event,
    HelloReceived,
    OperatorCommand,
    RenewReceived,
    ResultReceived,
)
from shearline.protocol.codec import decode
from shearline.protocol.errors import ProtocolError
from shearline.protocol.intake import Arrival, Presence
from shearline.protocol.keys import parse
from shearline.protocol.messages import Bye, Command, Credit, Hello, Message, Renew, Result

#: Complaints about peers that are written out; the rest is only counted.
COMPLAINTS_MAX = 100

_log = logging.getLogger("shearline.learner")

#: Keys repeat, and taking one apart costs as much as decoding a small message.
_parse = functools.lru_cache(maxsize=65_536)(parse)

#: What may come on each topic, and the event it becomes.
_TOPICS: Mapping[str, tuple[type[Message], Callable[[str, Any], Event]]] = MappingProxyType(
    {
        "hello": (Hello, HelloReceived),
        "credit": (Credit, CreditReceived),
        "renew": (Renew, RenewReceived),
        "result": (Result, ResultReceived),
        "bye": (Bye, ByeReceived),
        "op/cmd": (Command, lambda _, command: OperatorCommand(command.kind, command.why)),
    }
)


class Incoming:
    """Reads what came in.

    Attributes:
        malformed: Messages that the protocol does not allow.
    """

    def __init__(self) -> None:
        self.malformed = 0

    def event(self, item: Arrival | Presence) -> Event | None:
        """Return the event that an item means, or nothing."""
        try:
            return self._presence(item) if isinstance(item, Presence) else self._arrival(item)
        except ProtocolError as fault:
            self.malformed += 1
            if self.malformed <= COMPLAINTS_MAX:
                _log.warning("ignored on %s: %s", item.key[:200], fault)
            return None

    def _arrival(self, arrival: Arrival) -> Event | None:
        address = _parse(arrival.key)
        if address.topic not in _TOPICS:
            return None
        kind, event = _TOPICS[address.topic]
        return event(address.evaluator, decode(arrival.payload, kind))

    def _presence(self, presence: Presence) -> Event | None:
        address = _parse(presence.key)
        if presence.alive or address.topic != "live/ev":
            return None
        return EvaluatorGone(address.evaluator, address.life)
