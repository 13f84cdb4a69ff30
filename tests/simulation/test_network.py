"""Goal: no fault of network, evaluators or learner breaks a promise of the protocol.

Method: whole runs in virtual time, one per seed; invariants after every event, liveness once the
faults stop, and planted bugs to show that the simulation can fail.
"""

from __future__ import annotations

import pytest
from simulation.plants import NONE, PLANTS, Plant
from simulation.world import World

#: Runs of the quick suite, in groups that stay below a second.
QUICK, GROUP = 300, 25

#: A planted bug is to be found within so many runs.
PATIENCE = 500


def breaks(seed: int, plant: Plant = NONE) -> str:
    """Return what broke in one run, or nothing."""
    try:
        World(seed, plant).run()
    except (AssertionError, KeyError, ValueError) as fault:
        return f"{type(fault).__name__}: {fault}"
    return ""


def assert_holds(first: int, end: int) -> None:
    """Assert that nothing breaks, or say how to see it again."""
    for seed in range(first, end):
        fault = breaks(seed)
        assert not fault, f"{fault}\nagain: PYTHONPATH=tests python -m simulation {seed}"


@pytest.mark.parametrize("first", range(0, QUICK, GROUP))
def test_every_promise_holds_under_every_fault(first: int) -> None:
    assert_holds(first, first + GROUP)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(QUICK, 2300, 200))
def test_every_promise_holds_under_many_more(first: int) -> None:
    assert_holds(first, first + 200)


@pytest.mark.parametrize("name", PLANTS)
def test_a_planted_bug_is_found(name: str) -> None:
    plant = PLANTS[name]
    with plant.planted():
        assert any(breaks(seed, plant) for seed in range(PATIENCE)), f"{name}: not found"


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTS)
def test_a_planted_bug_is_found_by_one_seed_in_a_hundred(name: str) -> None:
    plant = PLANTS[name]
    with plant.planted():
        found = sum(bool(breaks(seed, plant)) for seed in range(PATIENCE))
    assert found >= PATIENCE / 100


def test_a_seed_decides_everything() -> None:
    first, again = World(7), World(7)
    first.run()
    again.run()
    assert first.journal == again.journal
    assert list(first.dispatcher.story) == list(again.dispatcher.story)
