from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.charge import Failures, charged
from shearline.learner.ledger import Trials

COSTS = st.floats(-1e12, 1e12, allow_nan=False)
OUTCOMES = st.lists(st.tuples(COSTS, st.booleans()), max_size=20)


def trials(outcomes: list[tuple[float, bool]]) -> Trials:
    count = len(outcomes)
    cost = np.array([cost for cost, _ in outcomes], dtype=np.float64)
    success = np.array([ok for _, ok in outcomes], dtype=np.bool_)
    return Trials(np.arange(count), np.zeros((count, 1)), cost, success)


@pytest.mark.parametrize("failures", list(Failures))
@given(outcomes=OUTCOMES)
def test_every_failure_is_dearer_than_every_success(
    failures: Failures, outcomes: list[tuple[float, bool]]
) -> None:
    told = trials(outcomes)
    cost = charged(told, failures)
    assert np.isfinite(cost).all()
    if told.success.any():
        np.testing.assert_array_equal(cost[told.success], told.cost[told.success])
        assert np.all(cost[~told.success] > told.cost[told.success].max())


@given(outcomes=OUTCOMES)
def test_failures_are_alike_unless_they_are_to_be_ordered(
    outcomes: list[tuple[float, bool]],
) -> None:
    told = trials(outcomes)
    assert len(set(charged(told)[~told.success])) <= 1
    lost = charged(told, Failures.ORDERED)[~told.success]
    assert np.all(np.diff(lost[np.argsort(told.cost[~told.success])]) >= 0.0)


def test_a_failure_costs_what_a_reward_of_minus_one_would() -> None:
    told = trials([(1.0, True), (4.0, True), (0.0, False), (100.0, False)])
    rewards = (4.0 - charged(told)) / (4.0 - 1.0)
    np.testing.assert_allclose(rewards, [1.0, 0.0, -1.0, -1.0])


def test_ordered_failures_spread_over_one_more_span() -> None:
    told = trials([(1.0, True), (4.0, True), (0.0, False), (50.0, False), (100.0, False)])
    ordered = charged(told, Failures.ORDERED)
    np.testing.assert_allclose(ordered[2:], [7.0, 8.5, 10.0])


def test_without_a_success_only_ordered_failures_differ() -> None:
    told = trials([(3.0, False), (2.0, False)])
    assert charged(told).tolist() == [0.0, 0.0]
    assert charged(told, Failures.ORDERED).tolist() == [3.0, 2.0]
