from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.interval import clopper_pearson_low
from shearline.learner.ledger import Trials
from shearline.learner.recommend import (
    NEIGHBOURHOOD,
    ON_POLICY_TRIALS,
    REACHES,
    Focus,
    _as_far_out,
    elite_focus,
    recommendation,
)
from shearline.protocol.space import Space
from shearline.sims.functions import fragile_ridge, ridge_success
from shearline.studies.benchmark import run_learner

SPACE = Space({"a": ("N", 0.0, 10.0), "b": ("m", -1.0, 1.0)})
MIDDLE = Focus(np.array([0.5, 0.5]), np.array([0.1, 0.2]))


def trials_around(count: int, wins: int, seed: int = 0) -> Trials:
    rng = np.random.default_rng(seed)
    success = np.arange(count) < wins
    cost = np.where(success, 0.4 + 0.1 * rng.random(count), 14.8)
    u = np.clip(0.5 + 0.1 * rng.standard_normal((count, 2)), 0.0, 1.0)
    order = rng.permutation(count)
    return Trials(np.arange(count), u, cost[order], success[order])


@given(count=st.integers(0, 100), data=st.data())
def test_what_is_said_is_consistent(count: int, data: st.DataObject) -> None:
    trials = trials_around(count, data.draw(st.integers(0, count)))
    answer = recommendation(SPACE, trials, MIDDLE)
    low, high = answer.interval
    assert 0.0 <= low <= answer.success_probability <= high <= 1.0
    assert math.isnan(answer.cost) == (not trials.last(ON_POLICY_TRIALS).success.any())


def test_the_claim_rests_on_the_latest_trials_alone() -> None:
    bad, good = trials_around(200, 0), trials_around(60, 60)
    both = Trials(
        np.arange(260),
        np.concatenate([bad.u, good.u]),
        np.concatenate([bad.cost, good.cost]),
        np.concatenate([bad.success, good.success]),
    )
    assert recommendation(SPACE, both, MIDDLE).interval[0] == pytest.approx(0.9513, abs=1e-4)


def test_the_cheapest_success_is_not_what_is_recommended() -> None:
    u = np.concatenate([np.full((20, 2), 0.3), [[0.9, 0.9]]])
    cost = np.concatenate([np.full(20, 0.5), [0.01]])
    trials = Trials(np.arange(21), u, cost, np.ones(21, dtype=np.bool_))
    assert np.linalg.norm(elite_focus(trials, 2).centre - 0.3) < 0.1


def test_before_any_success_the_middle_of_the_box_is_all_there_is() -> None:
    focus = elite_focus(trials_around(5, 0), 2)
    assert focus.centre.tolist() == [0.5, 0.5]


@given(
    count=st.integers(0, 60), seed=st.integers(0, 50), reach=st.sampled_from((0.3, 0.5, 1.0, 2.0))
)
def test_a_region_is_held_to_trials_as_far_out_as_its_own_draws(
    count: int, seed: int, reach: float
) -> None:
    distance = np.random.default_rng(seed).exponential(1.0, count)
    held = distance[_as_far_out(distance, reach)]
    near = distance[distance <= NEIGHBOURHOOD * reach]
    assert set(held) <= set(near)
    if len(held):
        assert np.sqrt(np.mean(held**2)) >= reach * (1 - 1e-12)
        assert held.min() == np.sort(near)[::-1][: len(held)].min()
    if len(held) < len(near):
        one_more = np.sort(near)[::-1][: len(held) + 1]
        assert np.sqrt(np.mean(one_more**2)) < reach


def test_where_all_succeed_the_region_has_the_spread_of_the_trials() -> None:
    rng = np.random.default_rng(1)
    for narrower in (1.0, 0.05):
        u = 0.5 + narrower * MIDDLE.scale * rng.standard_normal((60, 2))
        trials = Trials(np.arange(60), u, np.full(60, 0.5), np.ones(60, dtype=np.bool_))
        region = recommendation(SPACE, trials, MIDDLE).region
        assert region is not None
        draws = SPACE.normalise(region.sample(np.random.default_rng(0), 4000))
        np.testing.assert_allclose(draws.std(axis=0), narrower * MIDDLE.scale, rtol=0.5)
        assert region.trials == region.successes > 30
        shared_out = 1 - 0.05 / len(REACHES)
        assert region.success_low == clopper_pearson_low(region.trials, region.trials, shared_out)


def test_where_only_the_inside_succeeds_the_region_is_small() -> None:
    rng = np.random.default_rng(1)
    u = 0.5 + MIDDLE.scale * rng.standard_normal((60, 2))
    distance = MIDDLE.distance(u)
    success = distance < 1.0
    trials = Trials(np.arange(60), u, np.where(success, 0.5, 14.8), success)
    region = recommendation(SPACE, trials, MIDDLE).region
    assert region is not None
    smallest = REACHES[0] * np.median(distance) * math.sqrt(2)
    np.testing.assert_allclose(region.radius, smallest * MIDDLE.scale * np.array([10.0, 2.0]))
    assert region.success_low > recommendation(SPACE, trials, MIDDLE).interval[0]


def test_one_tuple_tried_again_and_again_makes_no_region() -> None:
    u = np.tile(MIDDLE.centre, (60, 1))
    trials = Trials(np.arange(60), u, np.full(60, 0.5), np.ones(60, dtype=np.bool_))
    assert recommendation(SPACE, trials, MIDDLE).region is None


@given(wins=st.integers(2, 60), seed=st.integers(0, 20))
def test_a_region_never_claims_more_than_its_own_trials_support(wins: int, seed: int) -> None:
    region = recommendation(SPACE, trials_around(60, wins, seed), MIDDLE).region
    if region is not None:
        assert region.success_low < region.successes / region.trials
        assert region.contains(recommendation(SPACE, trials_around(60, wins, seed), MIDDLE).theta)


def test_the_cost_of_the_middle_is_told_from_the_costs_around_it() -> None:
    trials = trials_around(60, 60)
    bowl = Trials(
        trials.number, trials.u, 0.3 + 0.2 * MIDDLE.distance(trials.u) ** 2, trials.success
    )
    assert recommendation(SPACE, bowl, MIDDLE).cost == pytest.approx(
        max(0.3, bowl.cost.min()), abs=1e-9
    )
    hill = Trials(trials.number, trials.u, 9.0 - MIDDLE.distance(trials.u), trials.success)
    assert hill.cost.min() <= recommendation(SPACE, hill, MIDDLE).cost <= hill.cost.max()


def test_noise_alone_promises_no_lower_cost_in_the_middle() -> None:
    n, promised = 20, []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u, cost = 0.5 + 0.1 * rng.standard_normal((60, n)), np.exp(0.5 * rng.standard_normal(60))
        trials = Trials(np.arange(60), u, cost, np.ones(60, dtype=np.bool_))
        focus = Focus(np.full(n, 0.5), np.full(n, 0.1))
        promised.append(recommendation(Space.unit(n), trials, focus).cost)
    assert np.mean(promised) == pytest.approx(math.exp(0.125), rel=0.1)


def test_a_single_success_makes_no_region() -> None:
    assert recommendation(SPACE, trials_around(10, 1), MIDDLE).region is None


@pytest.mark.slow
def test_on_the_ridge_problem_what_is_recommended_is_robust_and_not_overclaimed() -> None:
    problem = fragile_ridge()
    truth, low, cheapest = [], [], []
    for seed in range(6):
        run = run_learner("psp", problem, episodes=10, episode_length=20, seed=seed)
        truth.append(float(ridge_success(problem.space.normalise(run.recommendation.theta))))
        low.append(run.recommendation.interval[0])
        best = int(np.argmin(np.where(run.success, run.cost, np.inf)))
        cheapest.append(float(ridge_success(problem.space.normalise(run.theta[best]))))
    assert np.mean(truth) > 0.93
    assert np.sum(np.array(truth) >= np.array(low)) >= 5
    assert np.mean(cheapest) < 0.6
