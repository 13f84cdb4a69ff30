"""What the transport benchmark runs: a task that does nothing, or takes a precise time."""

from __future__ import annotations

import time
from collections.abc import Callable

from shearline.evaluator.base import Array, Outcome
from shearline.protocol.space import Space
from shearline.protocol.task import TaskSpec

#: The key-in-lock has 23 parameters: messages are as large as its are.
PARAMETERS = 23

#: A sleep may overshoot by a scheduler's tick; the rest of a wait is spun [s].
_SPIN_S = 0.0002


def wait(wall_s: float) -> None:
    """Let a precise time pass [s]."""
    end_s = time.perf_counter() + wall_s
    if wall_s > _SPIN_S:
        time.sleep(wall_s - _SPIN_S)
    while time.perf_counter() < end_s:
        pass


class WaitTask:
    """A trial that takes a given wall time and always succeeds.

    Args:
        wall_s: How long one trial takes [s]; 0 returns at once.
    """

    engine = "wait 1"

    def __init__(self, wall_s: float = 0.0) -> None:
        self._wall_s = wall_s
        self.spec = TaskSpec(
            name="wait",
            space=Space.box(PARAMETERS, -5.0, 5.0).spec(),
            options={"wall_s": wall_s},
            trial_s=10.0,
        )

    def warm(self) -> None:
        """Do nothing: there is nothing to load."""

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:  # noqa: ARG002
        """Wait; see :class:`shearline.evaluator.base.Task`."""
        wait(self._wall_s)
        beat()
        return Outcome(cost=1.0, success=True)
