"""The pulse: how fast the run goes and how long the owner's steps take. Bounded memory."""

from __future__ import annotations

from collections import deque
from statistics import quantiles

#: The rate is taken over so many looks, two a second.
LOOKS_MAX = 20

#: Steps that the 99th percentile is taken over.
STEPS_MAX = 10_000


class Pulse:
    """Figures about the owner's own work.

    Attributes:
        step_s_max: Longest step so far [s].
    """

    def __init__(self) -> None:
        self.step_s_max = 0.0
        self._steps_s: deque[float] = deque(maxlen=STEPS_MAX)
        self._looks: deque[tuple[float, int]] = deque(maxlen=LOOKS_MAX)

    def step(self, took_s: float) -> None:
        """Note how long one step took."""
        self._steps_s.append(took_s)
        self.step_s_max = max(self.step_s_max, took_s)

    def step_s_p99(self) -> float:
        """Return the 99th percentile of the last steps [s]."""
        if len(self._steps_s) < 2:
            return self.step_s_max
        return quantiles(self._steps_s, n=100)[98]

    def rate_hz(self, counted: int, now_s: float) -> float:
        """Note how many trials are counted by now; return how many of late per second [1/s]."""
        self._looks.append((now_s, counted))
        then_s, then = self._looks[0]
        return (counted - then) / (now_s - then_s) if now_s > then_s else 0.0
