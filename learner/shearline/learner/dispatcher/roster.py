"""The roster: who is there, as far as the learner has heard in this epoch.

Volatile on purpose: after a restart it is empty and fills with what evaluators say. Times are the
desk's observed clock [s]. It knows processes, not trials.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from shearline.learner.dispatcher.rules import (
    EVALUATORS_MAX,
    REST_S_MAX,
    SILENCE_LEASES,
    SILENCE_LEASES_STRUCK,
)
from shearline.protocol.messages import Hello

#: The kind of evaluator whose trials are never copied.
ROBOT = "robot"


@dataclass(slots=True)
class Challenger:
    """Another boot that claims a name in use: since when, until one of the two proves itself."""

    boot: str
    since_s: float


@dataclass(slots=True)
class Evaluator:
    """One boot of one evaluator.

    Attributes:
        seq: Number of the newest credit heard; older ones are ignored.
        heard_s: When anything of this boot was heard last.
        strikes: Attempts that lapsed in a row without a sign of its trial loop.
        rests_until_s: Handed nothing until then, because of the strikes.
        gone: Its liveliness vanished and it was not heard since.
        left: It said bye; a boot that left does not come back.
        was_held: It may believe the run is held, so it is told when that is over.
        said: The state that observers heard last.
    """

    name: str
    boot: str
    kind: str
    engine: str
    credits: int
    slots: int
    heard_s: float
    seq: int = -1
    strikes: int = 0
    rests_until_s: float = 0.0
    gone: bool = False
    left: bool = False
    was_held: bool = False
    done: int = 0
    lost: int = 0
    challenger: Challenger | None = None
    said: str = ""

    @classmethod
    def of(cls, name: str, hello: Hello, now_s: float) -> Evaluator:
        """Return the evaluator that introduces itself."""
        return cls(
            name, hello.boot, hello.kind, hello.engine, hello.credits, hello.slots, heard_s=now_s
        )

    def is_robot(self) -> bool:
        """Tell whether its trials are too dear to be run twice at once."""
        return self.kind == ROBOT

    def strike(self, now_s: float, lease_s: float) -> None:
        """Note a lapsed attempt: each in a row doubles the rest, up to a minute."""
        self.strikes += 1
        self.lost += 1
        rest_s = min(lease_s * 2.0 ** min(self.strikes - 1, 16), REST_S_MAX)
        self.rests_until_s = now_s + rest_s

    def forgive(self) -> None:
        """Its trial loop gave a sign of life."""
        self.strikes = 0
        self.rests_until_s = 0.0


class Roster:
    """All evaluators by name.

    Args:
        lease_s: Lease of the run [s]; silence is measured in it.
    """

    def __init__(self, lease_s: float) -> None:
        self._lease_s = lease_s
        self._by_name: dict[str, Evaluator] = {}

    def get(self, name: str) -> Evaluator | None:
        """Return the evaluator of that name, whatever its state."""
        return self._by_name.get(name)

    def admit(self, evaluator: Evaluator) -> bool:
        """Enter an evaluator in place of any other of its name; false if the roster is full."""
        if evaluator.name not in self._by_name and len(self._by_name) >= EVALUATORS_MAX:
            parted = next((e.name for e in self if e.left or e.gone), None)
            if parted is None:
                return False
            del self._by_name[parted]
        self._by_name[evaluator.name] = evaluator
        return True

    def is_heard(self, evaluator: Evaluator, now_s: float) -> bool:
        """Tell whether it gave a sign of life lately."""
        leases = SILENCE_LEASES_STRUCK if evaluator.strikes else SILENCE_LEASES
        return not (evaluator.left or evaluator.gone) and (
            now_s - evaluator.heard_s <= leases * self._lease_s
        )

    def is_ready(self, evaluator: Evaluator, now_s: float) -> bool:
        """Tell whether it may be handed an attempt, room aside."""
        return (
            evaluator.credits > 0
            and now_s >= evaluator.rests_until_s
            and self.is_heard(evaluator, now_s)
        )

    def ready(self, now_s: float) -> list[Evaluator]:
        """Return all that may be handed an attempt, in the order they came."""
        return [e for e in self if self.is_ready(e, now_s)]

    def __iter__(self) -> Iterator[Evaluator]:
        return iter(self._by_name.values())

    def __len__(self) -> int:
        return len(self._by_name)
