"""Every state of a small world, breadth first, so that what breaks is shown by the shortest path.

``PYTHONPATH=tests python -m simulation.search [WORLD ...]`` says how many states there are. States
are told apart by a 64-bit hash of all that can decide what follows; where the two evaluators are
alike, a state and its mirror image count as one. With a million states the chance that any two
share a hash is below one in thirty million.
"""

from __future__ import annotations

import sys
import time
from array import array
from collections import deque
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from simulation.plants import NONE, Plant
from simulation.promises import BrokenError
from simulation.small_state import Bounds, Frozen, State
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
        self._enter(first, self.world.key_of(first), "start", -1)
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


#: Looked at on every push.
QUICK = Bounds(trials=(1, 1), credits=(1, 1), kills=0, leases=1)

#: Looked at by hand: three trials first, then fewer of them but more that goes wrong.
WORLDS: Mapping[str, Bounds] = MappingProxyType(
    {
        "trials": Bounds(kills=0, leases=1),
        "aborts": Bounds(trials=(1, 1), credits=(1, 1), kills=0, leases=0, aborts=2),
        "stops": Bounds(kills=0, leases=0, stops=1),
        "robot": Bounds((1, 1), (1, 1), ("simulator", "robot"), kills=0, leases=1),
        "deadlines": Bounds(trials=(1,), credits=(1, 1), trial_s=4.0, kills=0, leases=3),
        "confirms": Bounds((1,), (1, 1), kills=0, leases=1, confirm=2),
        "ends": Bounds((2, 1), (1, 1), restarts=0, leases=0),
        "ends-and-restarts": Bounds((1, 1), (1, 1), leases=0),
    }
)


def main(names: list[str]) -> None:
    """Look at every state of some worlds, or of all, and say how many there are."""
    for name in names or WORLDS:
        found = search(WORLDS[name])
        sys.stdout.write(f"{name}: {found}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
