"""Every state of a small world, breadth first, so that what breaks is shown by the shortest path.

``PYTHONPATH=tests python -m simulation.search`` looks at the small world of three trials and says
how many states there are (``whole``: with an evaluator that dies as well). States are told apart
by a 64-bit hash of all that can decide what follows. With ten million states the chance that any
two share a hash is below one in three hundred thousand.
"""

from __future__ import annotations

import sys
import time
from array import array
from collections import deque
from typing import NamedTuple

from simulation.plants import NONE, Plant
from simulation.promises import BrokenError
from simulation.small_state import Bounds, Frozen, State, key_of
from simulation.small_world import SmallWorld

from shearline.learner.dispatcher.states import RunState


class Found(NamedTuple):
    """What a search came to."""

    states: int
    moves: int
    depth: int
    ended: int
    seconds: float


def search(bounds: Bounds, plant: Plant = NONE, states_max: int = 100_000_000) -> Found:
    """Visit every state.

    Raises:
        BrokenError: If a promise is broken, with the shortest way there; or if there is a state
            from which the run cannot end any more, or more than ``states_max`` states.
    """
    return _Search(SmallWorld(bounds, plant), states_max).run()


class _Search:
    def __init__(self, world: SmallWorld, states_max: int) -> None:
        self.world = world
        self.states_max = states_max
        self.numbers: dict[int, int] = {}
        self.labels: list[str] = []
        self.parents = array("q")
        self.depths = array("H")
        self.sources, self.targets = array("q"), array("q")
        self.ended: list[int] = []
        self.queue: deque[tuple[int, Frozen]] = deque()

    def run(self) -> Found:
        began_s = time.process_time()
        first = self.world.first()
        self._enter(first, key_of(*first), "start", -1)
        while self.queue:
            number, state = self.queue.popleft()
            try:
                for label, key, after in self.world.after(state):
                    self._enter(after, key, label, number)
            except (AssertionError, KeyError, ValueError) as fault:
                way = "\n".join(self._way(number))
                raise BrokenError(f"{type(fault).__name__}: {fault} after\n{way}") from fault
        self._check_end()
        seconds = time.process_time() - began_s
        return Found(
            len(self.numbers), len(self.sources), max(self.depths), len(self.ended), seconds
        )

    def _enter(self, state: State, key: int, label: str, parent: int) -> None:
        number = self.numbers.setdefault(key, len(self.numbers))
        if parent >= 0:
            self.sources.append(parent)
            self.targets.append(number)
        if number < len(self.labels):
            return
        if number >= self.states_max:
            raise BrokenError(f"more than {self.states_max} states")
        self.labels.append(sys.intern(label))
        self.parents.append(parent)
        self.depths.append(self.depths[parent] + 1 if parent >= 0 else 0)
        if state.desk.state is RunState.ENDED:
            self.ended.append(number)
        self.queue.append((number, self.world.freeze(state)))

    def _way(self, number: int) -> list[str]:
        way = []
        while number >= 0:
            way.append(self.labels[number])
            number = self.parents[number]
        return way[::-1]

    def _check_end(self) -> None:
        """From every state the run can still end: no state is a trap."""
        ahead: dict[int, list[int]] = {}
        for source, target in zip(self.sources, self.targets, strict=True):
            ahead.setdefault(target, []).append(source)
        reached, waiting = set(self.ended), list(self.ended)
        while waiting:
            for number in ahead.get(waiting.pop(), ()):
                if number not in reached:
                    reached.add(number)
                    waiting.append(number)
        trapped = next((n for n in range(len(self.labels)) if n not in reached), None)
        if trapped is not None:
            raise BrokenError("the run cannot end any more after\n" + "\n".join(self._way(trapped)))


#: Looked at on every push; by hand, with a minute to spare; and with an hour.
QUICK = Bounds(trials=(1, 1), credits=(1, 1), kills=0, leases=1)
SMALL = Bounds(kills=0, leases=1)
WHOLE = Bounds(kills=1, leases=1)


def main(arguments: list[str]) -> None:
    """Look at every state and say how many there are."""
    bounds = WHOLE if arguments == ["whole"] else SMALL
    found = search(bounds)
    sys.stdout.write(f"{bounds}\n{found}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
