"""The ledger: which tuples were asked for, by number, and what became of each.

It keeps what it is told as it was told (raw cost, success) and hands it out sorted by trial
number, so that nothing downstream can depend on the order of arrival. It knows no algorithm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.errors import LearnerError
from shearline.learner.prior import left

#: Trials there is room for at first.
ROOM_MIN = 64


@dataclass(frozen=True, slots=True)
class Trials:
    """Told outcomes, sorted by trial number.

    Attributes:
        number: Trial numbers ``(m,)``, rising; those of a prior are negative.
        u: Tuples in unit coordinates ``(m, n)``.
        cost: Raw costs ``(m,)`` in the task's unit; a failure's cost is kept but means little.
        success: Whether the task's goal was reached ``(m,)``.
    """

    number: npt.NDArray[np.int64]
    u: Array
    cost: Array
    success: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.number)

    def where(self, mask: npt.NDArray[np.bool_]) -> Trials:
        """Return the trials that a mask ``(m,)`` selects, still in order."""
        return Trials(self.number[mask], self.u[mask], self.cost[mask], self.success[mask])

    def last(self, count: int) -> Trials:
        """Return the latest ``count`` trials by number (all, if there are fewer)."""
        start = max(0, len(self) - count)
        return Trials(self.number[start:], self.u[start:], self.cost[start:], self.success[start:])


class Ledger:
    """Tuples by trial number and their outcomes.

    Kept in arrays that grow by doubling: adding and telling take the same time however many
    trials there are, and handing all of them out copies a few blocks of memory.

    Args:
        n: Number of parameters.
    """

    def __init__(self, n: int) -> None:
        self._asked = 0
        self._u = np.empty((ROOM_MIN, n))
        self._cost = np.empty(ROOM_MIN)
        self._success = np.zeros(ROOM_MIN, dtype=np.bool_)
        self._told = np.zeros(ROOM_MIN, dtype=np.bool_)
        nothing = np.zeros(0, dtype=np.bool_)
        self._prior = Trials(np.zeros(0, np.int64), np.zeros((0, n)), np.zeros(0), nothing)

    @property
    def asked(self) -> int:
        """How many tuples have been asked for; also the next trial's number."""
        return self._asked

    def add(self, u: Array) -> int:
        """Enter one tuple ``(n,)`` in unit coordinates and return its trial number."""
        if self._asked == len(self._told):
            self._grow()
        self._u[self._asked] = u
        self._asked += 1
        return self._asked - 1

    def tell(self, trial: int, cost: float, *, success: bool) -> None:
        """Enter one outcome; the same outcome told twice is ignored.

        Raises:
            LearnerError: If the trial was never asked for, has another outcome already, or its
                cost is not a finite number.
        """
        if not 0 <= trial < self._asked:
            raise LearnerError(
                f"expected a trial that was asked for (0 to {self._asked - 1}), got {trial}:"
                " tell only what ask returned"
            )
        if not math.isfinite(cost):
            raise LearnerError(
                f"expected a finite cost for trial {trial}, got {cost!r}: report a failed trial"
                " with success=False and the cost it is to be charged"
            )
        if not self._told[trial]:
            self._cost[trial], self._success[trial], self._told[trial] = cost, success, True
            return
        outcome = (float(cost), bool(success))
        known = (float(self._cost[trial]), bool(self._success[trial]))
        if known != outcome:
            raise LearnerError(
                f"trial {trial} was told (cost, success) = {known} before, now {outcome}:"
                " an outcome is final, drop the second one"
            )

    def prime(self, u: Array, cost: Array, success: npt.NDArray[np.bool_]) -> None:
        """Take over ``m`` trials of another run: ``u (m, n)``, ``cost (m,)``, ``success (m,)``."""
        self._prior = Trials(np.arange(-len(u), 0), u, cost, success)

    def known(self, episode: int) -> Trials:
        """Return what is left of the prior in an episode, and everything told so far."""
        prior, own = self._prior.last(left(len(self._prior), episode)), self.trials()
        if not len(prior):
            return own
        return Trials(
            np.concatenate([prior.number, own.number]),
            np.concatenate([prior.u, own.u]),
            np.concatenate([prior.cost, own.cost]),
            np.concatenate([prior.success, own.success]),
        )

    def trials(self) -> Trials:
        """Return everything told so far, sorted by trial number, without a prior."""
        number = np.flatnonzero(self._told)
        return Trials(number, self._u[number], self._cost[number], self._success[number])

    def _grow(self) -> None:
        """Double the room."""
        self._u = np.concatenate([self._u, np.empty_like(self._u)])
        self._cost = np.concatenate([self._cost, np.empty_like(self._cost)])
        self._success = np.concatenate([self._success, np.zeros_like(self._success)])
        self._told = np.concatenate([self._told, np.zeros_like(self._told)])
