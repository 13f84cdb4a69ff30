"""Goal: no fault of network, evaluators or learner breaks a promise of the protocol.

Method: whole runs in virtual time, one per seed; invariants after every event, liveness once the
faults stop, and planted bugs to show that the simulation can fail.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest
from simulation import adversary
from simulation.plants import NONE, PLANTS, Plant
from simulation.world import World

#: Runs of the quick suite, in groups that stay well below a second, and of every push.
QUICK, GROUP = 200, 25
PUSH, PUSH_GROUP = 2200, 200

#: A planted bug is to be found by one in a hundred of so many runs.
PATIENCE = 300


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
@pytest.mark.parametrize("first", range(QUICK, PUSH, PUSH_GROUP))
def test_every_promise_holds_under_many_more(first: int) -> None:
    assert_holds(first, first + PUSH_GROUP)


def test_who_was_replaced_while_it_thought_itself_welcome_greets_again() -> None:
    # A forged hello took a robot's name; the robot's own, late, made it a challenger that nobody
    # answered and that had no reason to say hello once more, and confirmations waited for it.
    assert_holds(257_703, 257_704)


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
    assert found >= PATIENCE / 100, f"{name}: {found} of {PATIENCE}"


def test_every_fault_strikes(monkeypatch: pytest.MonkeyPatch) -> None:
    struck: list[str] = []

    def noting(fault: Callable[..., None]) -> Callable[..., None]:
        def strike(*them: object) -> None:
            struck.append(fault.__name__)
            fault(*them)

        return strike

    monkeypatch.setattr(adversary, "_FAULTS", tuple(noting(f) for f in adversary._FAULTS))
    for seed in range(20):
        World(seed).run()
    assert set(struck) == {
        f"_{name}"
        for name in (
            *("kill", "kill_for_good", "freeze", "hang", "slow", "cut", "cut_all"),
            *("kill_learner", "freeze_learner", "set_clock", "operate", "stop"),
            *("forge", "lie", "boast", "pose"),
        )
    }


def test_a_seed_decides_everything() -> None:
    first, again = World(7), World(7)
    first.run()
    again.run()
    assert first.promises.journal == again.promises.journal
    assert list(first.dispatcher.story) == list(again.dispatcher.story)
