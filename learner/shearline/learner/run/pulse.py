"""The pulse: how fast the run goes and how long the owner's steps take. Bounded memory.

A step is measured twice: by the wall, and by the processor time of the owner's thread. The second
is what the learner itself spends, whatever else the machine does; the first adds what it waited
for: a core, the interpreter's lock, the disk.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass, field

#: The rate is taken over so many looks, two a second.
LOOKS_MAX = 20

#: Durations are sorted into bins that begin here and are this much longer each [s]: up to 100 s.
SHORTEST_S = 1e-6
GROWTH = 1.1
BINS = 194

_ENDS_S = tuple(SHORTEST_S * GROWTH**n for n in range(BINS))


@dataclass(slots=True)
class Durations:
    """How long something took, each time.

    Attributes:
        longest_s: The longest time so far [s].
    """

    longest_s: float = 0.0
    _counts: list[int] = field(default_factory=lambda: [0] * (BINS + 1))
    _count: int = 0

    def note(self, took_s: float) -> None:
        """Count one."""
        self._counts[bisect_left(_ENDS_S, took_s)] += 1
        self._count += 1
        self.longest_s = max(self.longest_s, took_s)

    def percentile_s(self, share: float) -> float:
        """Return what this share of all stayed within, at most a bin too long [s]."""
        wanted, seen = share * self._count, 0
        for end_s, count in zip(_ENDS_S, self._counts, strict=False):
            seen += count
            if seen >= wanted:
                return min(end_s, self.longest_s)
        return self.longest_s


class Pulse:
    """Figures about the owner's own work.

    Attributes:
        wall: Steps by the wall clock.
        cpu: Steps by the processor time of the owner's thread.
    """

    def __init__(self) -> None:
        self.wall = Durations()
        self.cpu = Durations()
        self._looks: deque[tuple[float, int]] = deque(maxlen=LOOKS_MAX)

    def step(self, wall_s: float, cpu_s: float) -> None:
        """Note how long one step took."""
        self.wall.note(wall_s)
        self.cpu.note(cpu_s)

    def rate_hz(self, counted: int, now_s: float) -> float:
        """Note how many trials are counted by now; return how many of late per second [1/s]."""
        self._looks.append((now_s, counted))
        then_s, then = self._looks[0]
        return (counted - then) / (now_s - then_s) if now_s > then_s else 0.0
