"""What a run recommends reads the same in the summary as in the learner's own words."""

from __future__ import annotations

import json
import math

import msgspec
import numpy as np
from simulation.lab import Lab

from shearline.learner.base import Recommendation
from shearline.learner.dispatcher.events import Planned, ProposalsReady
from shearline.learner.interval import wilson
from shearline.learner.region import Region
from shearline.learner.run.advice import advice, confirmed
from shearline.protocol.messages import OutcomeKind, Purpose
from shearline.protocol.space import Space

SPACE = Space({"push": ("N", 0.0, 20.0), "k_rot": ("N m/rad", 5.0, 200.0)})
REGION = Region(SPACE, np.array([12.0, 100.0]), np.array([2.0, 30.0]), 0.87, 0.95, 60, 58)
FOUND = Recommendation(np.array([12.0, 101.0]), 0.96, (0.9, 1.0), 0.5, REGION)


def confirming(kinds: list[OutcomeKind], confirm: int = 3, losses: int = 0) -> Lab:
    """Return a run whose confirmation went like that, trial by trial."""
    lab = Lab(trials=1, episodes=1, confirm=confirm, aborts_max=1)
    lab.hello("a", credits=1)
    lab.propose()
    lab.finish("a")
    lab.do(ProposalsReady(1, [Planned(1 + i, [12.0], i) for i in range(confirm)]))
    for i, kind in enumerate([*kinds, *[OutcomeKind.ABORTED] * losses]):
        lab.result("a", lab.given("a")[-1].token, kind, cost=0.1 * (i + 1))
    return lab


def test_a_recommendation_is_named_and_fit_for_json() -> None:
    said = json.loads(msgspec.json.encode(advice(SPACE, FOUND)))
    assert said["theta"] == {"push": 12.0, "k_rot": 101.0}
    assert said["interval"] == [0.9, 1.0]
    assert said["region"] == {
        "centre": {"push": 12.0, "k_rot": 100.0},
        "radius": {"push": 2.0, "k_rot": 30.0},
        "success_low": 0.87,
        "confidence": 0.95,
        "trials": 60,
        "successes": 58,
    }


def test_what_is_not_known_is_null() -> None:
    said = advice(SPACE, Recommendation(np.array([1.0, 6.0]), 0.0, (0.0, 1.0), math.nan))
    assert said.cost is None
    assert said.region is None


def test_a_run_that_confirms_nothing_says_nothing_about_it() -> None:
    lab = Lab(trials=1, episodes=1)
    assert confirmed(lab.dispatcher.book, FOUND, Purpose.CONFIRMATION) is None
    assert confirmed(lab.dispatcher.book, None, Purpose.CONFIRMATION) is None


def test_a_confirmation_counts_successes_and_their_costs() -> None:
    lab = confirming([OutcomeKind.SUCCESS, OutcomeKind.FAILURE, OutcomeKind.SUCCESS])
    said = confirmed(lab.dispatcher.book, FOUND, Purpose.CONFIRMATION)
    assert said is not None
    assert (said.trials, said.successes, said.lost) == (3, 2, 0)
    assert said.kinds == {"function": 3}
    assert said.interval == wilson(2, 3)
    assert said.claimed == 0.9
    assert said.mean_cost is not None
    np.testing.assert_allclose(said.mean_cost, (0.1 + 0.3) / 2)


def test_what_was_lost_is_said_and_does_not_count_for_or_against() -> None:
    lab = confirming([OutcomeKind.SUCCESS], confirm=3, losses=2)
    said = confirmed(lab.dispatcher.book, FOUND, Purpose.CONFIRMATION)
    assert said is not None
    assert (said.trials, said.successes, said.lost) == (1, 1, 2)
    assert said.interval == wilson(1, 1)


def test_a_confirmation_that_was_cut_short_says_what_is_known() -> None:
    lab = confirming([OutcomeKind.FAILURE], confirm=3)
    said = confirmed(lab.dispatcher.book, FOUND, Purpose.CONFIRMATION)
    assert said is not None
    assert (said.trials, said.successes, said.lost, said.success_rate) == (1, 0, 0, 0.0)
    assert said.mean_cost is None
