"""What is on record about one trial, as far as it can be held against another run of it.

A case is made of messages and traces; it does not know files, and it can be sent to another
process.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

import msgspec

from shearline.evaluator.base import Trace
from shearline.evaluator.plants import DEFAULT, plant_of
from shearline.protocol.messages import Counted, OutcomeKind, Proposed
from shearline.protocol.task import TaskSpec


@dataclass(frozen=True, slots=True)
class Case:
    """One trial as the record has it.

    Attributes:
        trial: Its number.
        task: What was being learned.
        theta: The tuple ``(n,)`` in task units that it was given.
        seed: The seed it was given.
        proposed: How it came into being, if that was recorded.
        outcome: How it ended; ``None`` if it never did.
        traces: One for each traced attempt.
    """

    trial: int
    task: TaskSpec
    theta: tuple[float, ...]
    seed: int
    proposed: Proposed | None = None
    outcome: Counted | None = None
    traces: tuple[Trace, ...] = ()

    @property
    def ended(self) -> bool:
        """Whether it has an outcome: a lost trial has none."""
        return self.outcome is not None and self.outcome.kind is not None

    @property
    def plant(self) -> str:
        """What it was tried on, the usual plant if it never ended."""
        return plant_of(self.outcome.engine) if self.outcome else DEFAULT

    @property
    def without_trace(self) -> bool:
        """Whether it ended and its task has no trace: then the outcome's digest is compared."""
        return self.ended and self.outcome is not None and not self.outcome.digest

    @property
    def digest(self) -> str:
        """Digest of the full trace on record, or of the outcome where the task has no trace."""
        outcome = self.outcome
        if outcome is None or outcome.kind is None:
            return ""
        said = outcome_digest(outcome.kind, outcome.cost, outcome.why, outcome.extras)
        return outcome.digest or said

    def contradiction(self) -> str:
        """Return in which way the record contradicts itself, or ``""``.

        Parameters that a trial never came to use change nothing when it is run again; that they
        are what was proposed only the record itself can tell.
        """
        proposed, outcome = self.proposed, self.outcome
        if proposed is None or outcome is None:
            return ""
        if proposed.seed != outcome.seed:
            return f"it was proposed with seed {proposed.seed}, recorded with {outcome.seed}"
        if len(proposed.theta) != len(outcome.theta):
            return f"{len(proposed.theta)} parameters were proposed, {len(outcome.theta)} recorded"
        rows = zip(self.task.space.items(), proposed.theta, outcome.theta, strict=False)
        for (name, (unit, _, _)), was, found in rows:
            if was.hex() != found.hex():
                return f"{name} was proposed as {was!r} {unit} and is recorded as {found!r} {unit}"
        return ""


def outcome_digest(kind: OutcomeKind, cost: float, why: str, extras: Mapping[str, float]) -> str:
    """Return 32 hexadecimal digits of an outcome, to the last bit of its numbers."""
    numbers = [(name, extras[name].hex()) for name in sorted(extras)]
    facts = msgspec.json.encode((kind, cost.hex(), why, numbers))
    return hashlib.sha256(facts).hexdigest()[:32]
