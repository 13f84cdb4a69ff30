"""The ranked learner as a whole; the contract of all learners is held in tests/learner."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from shearline.learner import Learner, Proposal, Space, SwitchError, create
from shearline.learner.base import Array
from shearline.learner.testing import play
from shearline.sims.functions import shifted, sphere
from shearline.sims.ridges import by_name
from shearline.studies.benchmark import run_learner


def update_s(trials: int) -> float:
    """Return the processor time of one update and 40 proposals after so many noisy trials."""
    learner = create("psp-ranked", Space.unit(23), trials, seed=1)
    rng = np.random.default_rng(trials)
    for p in learner.ask(trials):
        distance = float(np.linalg.norm(p.theta[:6] - 0.5))
        success = (distance < 0.7) != (rng.random() < 0.1)
        learner.tell(p.trial, cost=0.3 + distance if success else 14.8, success=bool(success))
    began = time.process_time()
    learner.ask(40)
    return time.process_time() - began


@pytest.mark.bench
def test_an_update_on_ten_times_the_trials_costs_no_more_than_a_few_times_as_much() -> None:
    update_s(40)
    assert update_s(20_000) < 4.0 * update_s(2_000)


def test_success_near_a_cheap_fragile_ridge_becomes_the_rule() -> None:
    run = run_learner("psp-ranked", by_name("sparse", 7), episodes=6, episode_length=20, seed=7)
    assert run.success[:20].mean() < 0.4
    assert run.success[-20:].mean() > 0.9
    assert by_name("sparse", 7).trial(run.recommendation.theta, np.random.default_rng(0))[1]


def test_a_bowl_is_followed_far_down() -> None:
    run = run_learner("psp-ranked", shifted(sphere, 10, 3), episodes=5, episode_length=20, seed=3)
    assert run.best < 0.03 * run.cost[:20].min()


def noisy_slope(**switches: float) -> tuple[Array, Array]:
    """Return where it ends on a slope of costs that are mostly noise, and how far it spreads."""
    learner, rng = (
        create("psp-ranked", Space.unit(6), 20, seed=1, **switches),
        np.random.default_rng(1),
    )

    def outcome(p: Proposal) -> tuple[float, bool]:
        return float(np.exp(0.6 * rng.standard_normal() - p.theta[:2].sum())), True

    play(learner, 6, outcome)
    last = np.array([p.theta for p in learner.ask(20)])
    return learner.recommend().theta, last.std(axis=0)


def test_costs_that_are_mostly_noise_do_not_end_the_search() -> None:
    kept, lost = noisy_slope()[1], noisy_slope(floor=0.0)[1]
    assert kept.mean() > 1.5 * lost.mean()


def test_a_slope_under_noise_is_followed_beyond_the_best_that_was_tried() -> None:
    middle = noisy_slope()[0]
    assert middle[:2].min() > 0.85
    assert middle[:2].sum() > noisy_slope(moves=0)[0][:2].sum()


def refreshed(every: int) -> Learner:
    return create("psp-ranked", Space.unit(3), 12, seed=4, refresh=every)


def test_refreshing_within_an_episode_hears_what_was_told_in_it() -> None:
    thetas = {}
    for every in (0, 4):
        learner = refreshed(every)
        play(learner, 2, lambda p: (float(p.theta[0]), True))
        for p in learner.ask(4):
            learner.tell(p.trial, cost=float(p.theta[1]) - 5.0, success=True)
        thetas[every] = np.array([p.theta for p in learner.ask(8)])
    assert not np.array_equal(thetas[0], thetas[4])


def test_refreshing_does_not_depend_on_the_order_of_tells() -> None:
    one, other = refreshed(4), refreshed(4)
    for _ in range(9):
        ahead, back = one.ask(4), other.ask(4)
        assert all(np.array_equal(a.theta, b.theta) for a, b in zip(ahead, back, strict=True))
        for learner, order in ((one, ahead), (other, back[::-1])):
            for p in order:
                learner.tell(p.trial, cost=float(np.sum(p.theta)), success=bool(p.theta[0] < 0.8))


def test_few_successes_are_scouted_around() -> None:
    learner = create("psp-ranked", Space.unit(5), 20, seed=0)
    first = learner.ask(20)
    for p in first:
        learner.tell(p.trial, cost=1.0, success=p.trial == 11)
    assert learner.snapshot()["proposal"] == "scouts"
    second = np.array([p.theta for p in learner.ask(20)])
    distance = np.linalg.norm(second - first[11].theta, axis=1)
    assert distance[1::2].mean() < 0.8 * distance[::2].mean()


@pytest.mark.parametrize(
    "switches",
    [
        {"draws": 0},
        {"draws": 2.5},
        {"cost": 1},
        {"refresh": -1},
        {"floor": 2.0},
        {"moves": -1},
        {"sharp": 1},
    ],
)
def test_a_senseless_switch_is_refused(switches: dict[str, Any]) -> None:
    with pytest.raises(SwitchError, match=next(iter(switches))):
        create("psp-ranked", Space.unit(2), **switches)
