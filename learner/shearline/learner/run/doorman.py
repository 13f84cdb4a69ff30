"""The doorman: who may still come in when the inbox is crowded, told by a look at the bytes.

Who floods has, as a rule, neither the boot nor a token of those it speaks for. The doorman looks
for them in what came, without decoding it, so that a crowd of forgeries costs next to nothing and
takes no room from the evaluator on whose key it came. It judges no message, only whether one could
mean anything to the desk; it may refuse what would have had an effect (an answer to a boot that
was replaced), because that is repeated. It is asked in network threads while the owner goes on: it
reads the desk by single look-ups and never changes it.
"""

from __future__ import annotations

import re
from itertools import islice

from shearline.learner.dispatcher.desk import Desk
from shearline.protocol.codec import CONTROL_BYTES_MAX
from shearline.protocol.intake import Arrival, Presence

#: Longer keys are of nobody: a run and an evaluator have at most 64 characters each.
KEY_CHARS_MAX = 256

#: A hello holds a few short texts; an order to the learner holds one of up to 1024 characters.
INTRODUCTION_BYTES_MAX = 8 * 1024

#: Tokens of the learner, and their like (boots, digests), that are looked up in one message. A
#: renewal names a boot and up to 1024 tokens, of which one that is known is enough.
LOOKUPS_MAX = 8

_TOKEN = re.compile(rb"[0-9a-f]{32}")
_ORDERS = (b"hold", b"resume", b"stop")


def is_oversized(arrival: Arrival) -> bool:
    """Tell whether a message is larger than any the learner reads, or its key than any there is."""
    return len(arrival.payload) > CONTROL_BYTES_MAX or len(arrival.key) > KEY_CHARS_MAX


class Doorman:
    """Looks who comes.

    Args:
        desk: The run's, read only.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk

    def knows(self, arrival: Arrival) -> bool:
        """Tell whether a message could have an effect, for all its bytes show."""
        whose, _, topic = arrival.key.rpartition("/")
        name, payload = whose.rpartition("/")[2], arrival.payload
        match topic:
            case "result" | "renew":
                return self._shows_a_token_of(name, payload)
            case "credit" | "bye":
                return self._shows_the_boot_of(name, payload)
            case "hello":
                return len(payload) <= INTRODUCTION_BYTES_MAX
            case "cmd":
                is_short = len(payload) <= INTRODUCTION_BYTES_MAX
                return name == "op" and is_short and any(order in payload for order in _ORDERS)
        return False

    def minds(self, presence: Presence) -> bool:
        """Tell whether it makes a difference that a liveliness token came or went."""
        if presence.alive or len(presence.key) > KEY_CHARS_MAX:
            return False
        whose, _, boot = presence.key.rpartition("/")
        name = whose.rpartition("/")[2]
        known = self._desk.roster.get(name)
        return (known is not None and known.boot == boot) or name in self._desk.book.held_by

    def _shows_a_token_of(self, name: str, payload: bytes) -> bool:
        attempts = self._desk.book.attempts
        for found in islice(_TOKEN.finditer(payload), LOOKUPS_MAX):
            attempt = attempts.get(found[0].decode())
            if attempt is not None and attempt.evaluator == name:
                return True
        return False

    def _shows_the_boot_of(self, name: str, payload: bytes) -> bool:
        known = self._desk.roster.get(name)
        return known is not None and known.boot.encode() in payload
