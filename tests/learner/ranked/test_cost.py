from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.learner.ranked.cost import fit_cost

SEEDS = st.integers(0, 2**32 - 1)


def test_a_bowl_is_found_to_be_a_bowl() -> None:
    rng = np.random.default_rng(1)
    u, fresh, at = rng.random((80, 10)), rng.random((50, 10)), rng.random(10)
    model = fit_cost(u, np.sum((u - at) ** 2, axis=1))
    truth = np.sum((fresh - at) ** 2, axis=1)
    assert np.abs(model.mean(fresh) - truth).max() < 0.02 * truth.max()
    assert model.noise < 0.01


def test_a_heap_of_costs_is_found_to_be_noise() -> None:
    rng = np.random.default_rng(2)
    model = fit_cost(rng.random((120, 6)), rng.exponential(1.0, 120) + 1.0)
    assert model.noise > 0.5


@settings(max_examples=10)
@given(SEEDS)
def test_doubt_grows_away_from_the_data_and_shows_in_a_pessimistic_cost(seed: int) -> None:
    rng = np.random.default_rng(seed)
    u = 0.5 + 0.05 * rng.standard_normal((40, 3))
    model = fit_cost(u, np.sin(20.0 * u[:, 0]) + np.sum(u**2, axis=1))
    near, far = model.deviation(np.array([[0.5, 0.5, 0.5], [1.0, 0.0, 1.0]]))
    assert near <= far
    assert np.all(model.at(u, 1.0) >= model.mean(u))


@pytest.mark.parametrize("cost", [0.0, -3.5, 1e12])
def test_equal_costs_are_expected_everywhere(cost: float) -> None:
    u = np.random.default_rng(0).random((9, 4))
    np.testing.assert_array_equal(fit_cost(u, np.full(9, cost)).mean(u), cost)


@settings(max_examples=10)
@given(SEEDS, st.floats(0.01, 100.0), st.floats(-10.0, 10.0))
def test_the_ranking_survives_another_unit_and_zero_of_cost(
    seed: int, unit: float, zero: float
) -> None:
    rng = np.random.default_rng(seed)
    u, fresh = rng.random((30, 3)), rng.random((30, 3))
    cost = np.sum((u - 0.3) ** 2, axis=1)
    one, other = fit_cost(u, cost).mean(fresh), fit_cost(u, unit * cost + zero).mean(fresh)
    assert np.corrcoef(np.argsort(np.argsort(one)), np.argsort(np.argsort(other)))[0, 1] > 0.99
