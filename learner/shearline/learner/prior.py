"""A prior: the trials of another run, which a learner may start from.

They count as if they had come before the run's own, and fade: with every episode half as many of
them are left, the latest. What another lock, plant or day taught is a good first guess and a poor
last word; after eight episodes 200 trials are forgotten. Nothing that a run claims ever rests on
them.
"""

from __future__ import annotations

import msgspec


class Prior(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Trials of another run on the same parameters, in order.

    Attributes:
        run: Its name, ``""`` where there is none.
        task: What it learned.
        theta: Tuples ``(trials, n)`` in task units.
        cost: What each cost ``(trials,)``.
        success: Which succeeded ``(trials,)``.
    """

    run: str = ""
    task: str = ""
    theta: list[list[float]] = []
    cost: list[float] = []
    success: list[bool] = []

    def __post_init__(self) -> None:
        if not len(self.theta) == len(self.cost) == len(self.success):
            raise ValueError(
                f"a warm start needs a cost and a success for each tuple, got {len(self.theta)}"
                f" tuples, {len(self.cost)} costs, {len(self.success)} successes"
            )

    def __bool__(self) -> bool:
        return bool(self.theta)


def left(trials: int, episode: int) -> int:
    """Return how many of so many prior trials count in an episode, from 0."""
    return trials >> episode
