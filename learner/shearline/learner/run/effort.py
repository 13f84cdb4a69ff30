"""What a step has cost so far: the processor time of the thread that takes it.

To ask the system for it costs as much as to read a message, and a step would ask after each one.
But nobody spends more processor time than passes on the wall, which is told at once: so the system
is asked only where what it said last, and the time since, leave the answer open.
"""

from __future__ import annotations

import time

#: A step that took less by the wall is taken to have computed all the while [s].
TOLD_APART_S = 0.001


class Effort:
    """Begins to count for the thread that makes one."""

    __slots__ = ("_asked_s", "_began_cpu_s", "_spent_s")

    def __init__(self) -> None:
        self._began_cpu_s = time.thread_time()
        self._asked_s = time.perf_counter()
        self._spent_s = 0.0

    def exceeds(self, limit_s: float) -> bool:
        """Tell whether more processor time was spent than that [s]."""
        return self._at_most_s() > limit_s and self._ask_s() > limit_s

    def cpu_s(self) -> float:
        """Return the processor time spent [s]; of a short stretch, the time that passed."""
        at_most_s = self._at_most_s()
        return at_most_s if at_most_s < TOLD_APART_S else self._ask_s()

    def _at_most_s(self) -> float:
        return self._spent_s + time.perf_counter() - self._asked_s

    def _ask_s(self) -> float:
        self._asked_s = time.perf_counter()
        self._spent_s = time.thread_time() - self._began_cpu_s
        return self._spent_s
