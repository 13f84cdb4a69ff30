"""What a step has cost so far: the processor time of the thread that takes it.

To ask the system for it costs as much as to read a message, and a step would ask after each one.
But nobody spends more processor time than passes on the wall, which is told at once: so the system
is asked only where the wall says that the answer could matter.
"""

from __future__ import annotations

import time

#: A step that took less by the wall is taken to have computed all the while [s].
TOLD_APART_S = 0.001


class Effort:
    """Begins to count for the thread that makes one."""

    __slots__ = ("_began_cpu_s", "_began_s")

    def __init__(self) -> None:
        self._began_cpu_s = time.thread_time()
        self._began_s = time.perf_counter()

    def exceeds(self, limit_s: float) -> bool:
        """Tell whether more processor time was spent than that [s]."""
        return self._wall_s() > limit_s and self._cpu_s() > limit_s

    def cpu_s(self) -> float:
        """Return the processor time spent [s]; of a short stretch, the time that passed."""
        wall_s = self._wall_s()
        return wall_s if wall_s < TOLD_APART_S else self._cpu_s()

    def _wall_s(self) -> float:
        return time.perf_counter() - self._began_s

    def _cpu_s(self) -> float:
        return time.thread_time() - self._began_cpu_s
