"""Virtual time and a network that delays, drops, duplicates and reorders, all from one seed."""

from __future__ import annotations

import heapq
import math
import random
from collections.abc import Callable


class Clock:
    """A queue of things to happen, in virtual time [s]."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._next = 0
        self._heap: list[tuple[float, int, Callable[[], None]]] = []

    def after(self, delay_s: float, act: Callable[[], None]) -> None:
        """Have ``act`` called in ``delay_s``."""
        self._next += 1
        heapq.heappush(self._heap, (self.now_s + delay_s, self._next, act))

    def step(self) -> bool:
        """Let the next thing happen; false if there is none."""
        if not self._heap:
            return False
        self.now_s, _, act = heapq.heappop(self._heap)
        act()
        return True


class Network:
    """Carries calls instead of bytes.

    Args:
        clock: Virtual time.
        rng: Source of all chance.
    """

    def __init__(self, clock: Clock, rng: random.Random) -> None:
        self.clock = clock
        self.rng = rng
        self.faulty = True
        self.delay_s = math.pow(10.0, rng.uniform(-4, -1))
        self.drop = rng.choice((0.0, 0.05, 0.3))
        self.duplicate = rng.choice((0.05, 0.3))
        #: Evaluators of whom nothing, and to whom nothing, gets through.
        self.mute: set[str] = set()
        self.deaf: set[str] = set()

    def carry(self, evaluator: str, arrive: Callable[[], None], *, up: bool) -> None:
        """Deliver from (``up``) or to one evaluator: once, twice, later, or never."""
        if evaluator in (self.mute if up else self.deaf):
            return
        if self.faulty and self.rng.random() < self.drop:
            return
        self.clock.after(self._delay_s(), arrive)
        if self.faulty and self.rng.random() < self.duplicate:
            self.clock.after(self._delay_s() * 10.0, arrive)

    def calm(self) -> None:
        """Lose, double and hold back nothing any more."""
        self.faulty = False
        self.mute.clear()
        self.deaf.clear()

    def _delay_s(self) -> float:
        # A heavy tail: now and then a message overtakes many others.
        slow = 20.0 if self.faulty and self.rng.random() < 0.05 else 1.0
        return self.delay_s * slow * self.rng.random()
