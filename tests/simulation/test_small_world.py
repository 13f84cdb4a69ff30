"""Goal: no state of a small world breaks a promise. Method: look at every one of them."""

from __future__ import annotations

import pytest
from simulation.plants import PLANTS
from simulation.promises import BrokenError
from simulation.search import QUICK, WORLDS, search
from simulation.small_state import Bounds

#: A world in which a planted bug has consequences; found at once, or not there.
HAUNTS = {
    "no dedupe": QUICK,
    "acknowledged before the journal": QUICK,
    "epoch not persisted": QUICK,
    "proposals not persisted": QUICK,
    "attempts not persisted": QUICK,
    "results not persisted": QUICK,
    "tokens believed from anyone": QUICK,
    "late results thrown away": Bounds((1,), (1, 1), restarts=0, leases=3, kills=0),
    "handing out after stop": Bounds((2,), (1, 1), leases=0, kills=0, stops=1),
    "reviving what was given out again": QUICK,
    "learning from confirmations": Bounds((1,), (1, 1), leases=0, kills=0, confirm=1),
    "copies for anyone": Bounds((1,), (1, 1), ("simulator", "robot"), restarts=0, kills=0),
}


def test_every_state_of_a_very_small_world_keeps_every_promise() -> None:
    found = search(QUICK)
    assert found.states > 1000
    assert found.ended > 100


@pytest.mark.parametrize("name", HAUNTS)
def test_a_planted_bug_is_found_by_the_shortest_way(name: str) -> None:
    plant = PLANTS[name]
    with plant.planted(), pytest.raises(BrokenError, match="after\nstart"):
        search(HAUNTS[name], plant)


@pytest.mark.slow
def test_the_same_world_without_the_bug_has_none() -> None:
    for bounds in set(HAUNTS.values()) - {QUICK}:
        search(bounds)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", WORLDS)
def test_every_state_of_a_small_world_keeps_every_promise(name: str) -> None:
    assert search(WORLDS[name]).ended > 100
