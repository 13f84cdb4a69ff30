from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.ledger import Trials
from shearline.learner.psp.config import Labels, RewardMap
from shearline.learner.psp.reward import (
    UNBOUNDED,
    expected,
    mean_cost,
    neighbour_success,
    positives,
    rewards,
    update,
)


def trials_of(costs: list[float], wins: list[bool], seed: int = 0, n: int = 2) -> Trials:
    u = np.random.default_rng(seed).random((len(costs), n))
    return Trials(np.arange(len(costs)), u, np.array(costs), np.array(wins, dtype=np.bool_))


COSTS = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30)


@st.composite
def some_trials(draw: st.DrawFn) -> Trials:
    costs = draw(COSTS)
    wins = draw(st.lists(st.booleans(), min_size=len(costs), max_size=len(costs)))
    return trials_of(costs, wins, draw(st.integers(0, 99)))


@given(trials=some_trials())
def test_failures_are_never_good_and_somebody_is_while_anything_succeeded(trials: Trials) -> None:
    threshold = UNBOUNDED
    for _ in range(8):
        for labels in Labels:
            good, _ = update(trials, threshold, labels, RewardMap.LINEAR)
            assert not np.any(good & ~trials.success)
            assert good.any() == trials.success.any()
        _, threshold = update(trials, threshold, Labels.NEW, RewardMap.LINEAR)


@given(trials=some_trials())
def test_the_threshold_never_rises_and_settles_on_the_cheapest(trials: Trials) -> None:
    threshold = UNBOUNDED
    for _ in range(200):
        _, moved = update(trials, threshold, Labels.NEW, RewardMap.LINEAR)
        assert moved <= threshold + 1e-6
        threshold = moved
    if trials.success.any():
        cheapest = trials.cost[trials.success].min()
        assert threshold == pytest.approx(cheapest, rel=1e-6, abs=1e-3)


def test_the_first_update_labels_against_the_mean_or_against_nothing() -> None:
    trials = trials_of([1.0, 2.0, 6.0, 9.0], [True, True, True, False])
    new, threshold = update(trials, UNBOUNDED, Labels.NEW, RewardMap.LINEAR)
    previous, same = update(trials, UNBOUNDED, Labels.PREVIOUS, RewardMap.LINEAR)
    assert threshold == same == 3.0
    assert new.tolist() == [True, True, False, False]
    assert previous.tolist() == [True, True, True, False]


@given(trials=some_trials(), a=st.floats(0.1, 10.0), b=st.floats(-10.0, 10.0))
def test_labels_do_not_depend_on_the_unit_of_cost(trials: Trials, a: float, b: float) -> None:
    # Rounded, so that no cost lies within a rounding error of the mean of others.
    cost = np.round(trials.cost / 1e5, 1)
    first = Trials(trials.number, trials.u, cost, trials.success)
    other = Trials(trials.number, trials.u, a * cost + b, trials.success)
    good, threshold = update(first, UNBOUNDED, Labels.NEW, RewardMap.LINEAR)
    scaled, _ = update(other, UNBOUNDED, Labels.NEW, RewardMap.LINEAR)
    sure = ~np.isclose(cost, threshold, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(good[sure], scaled[sure])


def test_a_single_good_sample_stays_good() -> None:
    trials = trials_of([5.0, 0.1 + 0.2, 5.0], [False, True, False])
    good, threshold = update(trials, UNBOUNDED, Labels.NEW, RewardMap.LINEAR)
    again, _ = update(trials, threshold, Labels.NEW, RewardMap.LINEAR)
    assert good.tolist() == again.tolist() == [False, True, False]


@given(cost=st.floats(-1e200, 1e200), count=st.integers(1, 50), reward=st.sampled_from(RewardMap))
def test_equal_samples_stay_good_together(cost: float, count: int, reward: RewardMap) -> None:
    trials = trials_of([cost] * count, [True] * count)
    assert positives(trials, mean_cost(trials.cost, reward)).all()


def test_the_reciprocal_map_takes_the_harmonic_mean_of_positive_costs_only() -> None:
    assert mean_cost(np.array([1.0, 3.0]), RewardMap.RECIPROCAL) == pytest.approx(1.5)
    assert mean_cost(np.array([-1.0, 3.0]), RewardMap.RECIPROCAL) == 1.0
    assert mean_cost(np.array([1.0, 3.0]), RewardMap.LINEAR) == 2.0


def test_rewards_are_one_for_the_cheapest_and_minus_one_for_failures() -> None:
    trials = trials_of([1.0, 2.0, 3.0, 0.5], [True, True, True, False])
    assert rewards(trials, RewardMap.LINEAR).tolist() == [1.0, 0.5, 0.0, -1.0]
    assert rewards(trials, RewardMap.RECIPROCAL)[:2].tolist() == [1.0, 0.5]


@given(costs=COSTS, k=st.integers(0, 40))
def test_where_nothing_fails_the_expected_cost_is_the_cost(costs: list[float], k: int) -> None:
    trials = trials_of(costs, [True] * len(costs))
    np.testing.assert_allclose(
        expected(trials, np.ones(2), k).cost, trials.cost, rtol=1e-12, atol=1e-6
    )


def test_a_cheap_success_among_failures_is_worth_less_than_a_dear_one_among_successes() -> None:
    fragile = np.full((10, 2), 0.1) + np.arange(10)[:, None] * 1e-3
    u = np.concatenate([fragile, fragile + 0.8])
    success = np.array([True] + [False] * 9 + [True] * 10)
    cost = np.where(success, np.where(np.arange(20) < 10, 0.2, 0.5), 10.0)
    trials = Trials(np.arange(20), u, cost, success)
    judged = expected(trials, np.ones(2), 6)
    assert judged.cost[0] > judged.cost[10:].max()
    np.testing.assert_array_equal(judged.cost[~success], cost[~success])


def test_the_neighbours_are_the_nearest_others_in_the_given_scale() -> None:
    rng = np.random.default_rng(3)
    trials = trials_of([1.0] * 700, (rng.random(700) < 0.5).tolist(), n=3)
    scale = np.array([1.0, 0.1, 10.0])
    found = neighbour_success(trials, scale, 5)
    for k in (0, 1, 511, 512, 699):
        distance = np.linalg.norm((trials.u - trials.u[k]) / scale, axis=1)
        distance[k] = np.inf
        wins = trials.success[np.argsort(distance)[:5]].sum()
        assert found[k] == pytest.approx((wins + 2.0 * trials.success.mean()) / 7.0)
