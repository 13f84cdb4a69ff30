from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from shearline.sims.functions import (
    BOUND,
    SHIFT_MAX,
    Array,
    centred,
    fragile_ridge,
    noisy_sphere,
    optimum,
    rastrigin,
    ridge_cost,
    ridge_success,
    shifted,
    sphere,
    two_peaks,
    two_peaks_narrow,
)

POINTS = hnp.arrays(np.float64, (5, 7), elements=st.floats(-BOUND, BOUND))


@given(POINTS)
def test_rows_are_evaluated_as_if_they_were_alone(x: Array) -> None:
    for function in (sphere, rastrigin, lambda u: ridge_cost(u / 10 + 0.5)):
        np.testing.assert_allclose(function(x), [function(row) for row in x], rtol=1e-12)


@given(POINTS)
def test_both_benchmarks_are_least_at_the_origin(x: Array) -> None:
    assert sphere(np.zeros(7)) == rastrigin(np.zeros(7)) == 0.0
    assert np.all(sphere(x) >= 0.0)
    assert np.all(rastrigin(x) >= sphere(x) - 1e-9)


def test_rastrigin_agrees_with_its_equation() -> None:
    x = np.array([0.5, -1.0])
    by_hand = 20.0 + (0.25 - 10.0 * np.cos(np.pi)) + (1.0 - 10.0 * np.cos(-2.0 * np.pi))
    assert rastrigin(x) == pytest.approx(by_hand)


@pytest.mark.parametrize("function", [sphere, rastrigin])
def test_shifting_moves_the_optimum_to_a_place_of_the_seeds_own(
    function: object,
) -> None:
    assert callable(function)
    for seed in range(20):
        at = optimum(20, seed)
        problem = shifted(function, 20, seed)
        assert np.all(np.abs(at) <= SHIFT_MAX)
        assert float(problem.cost(at)) == pytest.approx(0.0, abs=1e-9)
        assert problem.space.contains(at)
    assert not np.allclose(optimum(20, 0), optimum(20, 1))
    np.testing.assert_array_equal(optimum(20, 3), optimum(20, 3))


def test_centred_problems_have_their_optimum_in_the_middle_of_the_papers_box() -> None:
    problem = centred(sphere, 5)
    assert problem.trial(np.zeros(5), np.random.default_rng(0)) == (0.0, True)
    assert problem.space.low.tolist() == [-5.0] * 5
    assert problem.space.high.tolist() == [5.0] * 5


def maxima(reward: Array) -> int:
    """Count strict local maxima of values on a square grid."""
    inner = reward[1:-1, 1:-1]
    around = [
        reward[1 + i : reward.shape[0] - 1 + i, 1 + j : reward.shape[1] - 1 + j]
        for i in (-1, 0, 1)
        for j in (-1, 0, 1)
        if (i, j) != (0, 0)
    ]
    return int(np.all([inner > other for other in around], axis=0).sum())


def test_the_two_peaks_as_printed_are_one_and_the_narrow_ones_two() -> None:
    axis = np.linspace(0.0, 1.0, 101)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1)
    assert maxima(two_peaks(grid)) == 1
    assert maxima(two_peaks_narrow(grid)) == 2
    assert two_peaks(np.array([0.5, 0.5])) == pytest.approx(2.0 * np.exp(-0.125))


def test_half_of_the_ridge_problem_succeeds_and_the_basin_is_robust() -> None:
    u = np.random.default_rng(0).random((20_000, 23))
    assert 0.42 < ridge_success(u).mean() < 0.55
    middle = np.full(23, 0.35)
    assert ridge_success(middle) > 0.98
    assert ridge_cost(middle) == pytest.approx(0.5)


def test_the_ridge_is_cheaper_than_anything_robust_and_fails_more_often_than_not() -> None:
    u = np.random.default_rng(1).random((5000, 23))
    u[:, 0] = 0.86 + 0.08 * u[:, 0]
    assert np.all(ridge_success(u) == 0.4)
    assert ridge_cost(u).max() < 0.5


def test_a_trial_fails_as_often_as_its_chance_says() -> None:
    problem = fragile_ridge()
    theta = np.full(23, 0.35)
    theta[0] = 0.9
    rng = np.random.default_rng(2)
    outcomes = [problem.trial(theta, rng) for _ in range(2000)]
    assert np.mean([ok for _, ok in outcomes]) == pytest.approx(0.4, abs=0.04)
    assert {cost for cost, ok in outcomes if not ok} == {problem.failure_cost}


@given(n=st.integers(1, 30), seed=st.integers(0, 100))
def test_the_noisy_sphere_is_best_and_cheapest_at_its_optimum(n: int, seed: int) -> None:
    problem = noisy_sphere(n, seed)
    assert problem.success is not None
    u = np.random.default_rng(seed).random((500, n))
    cheapest = u[np.argmin(problem.cost(u))]
    assert problem.success(cheapest) == problem.success(u).max()
    assert np.all(problem.cost(u) >= 0.2)
    assert np.all(problem.success(u) <= 0.97)
