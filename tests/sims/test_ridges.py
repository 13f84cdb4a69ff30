from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.sims.ridges import FAILURE_COST, KINDS, N, by_name

SEEDS = st.integers(0, 1000)


@settings(max_examples=20)
@given(SEEDS, st.sampled_from(sorted(KINDS)))
def test_the_ridge_is_cheaper_than_the_basin_and_fails_more_often(seed: int, kind: str) -> None:
    ridge = KINDS[kind](seed)
    middle = 0.5 + ridge.centre @ ridge.axes
    on_strip = middle + (ridge.strip_at - ridge.centre[0]) * ridge.axes[0]
    assert ridge.cost(on_strip) < ridge.cost(middle) / 2.0
    assert ridge.success(on_strip) < 0.5
    assert ridge.success(middle) > 0.99


@pytest.mark.parametrize(
    ("kind", "low", "high"),
    [("straight", 0.45, 0.65), ("rotated", 0.4, 0.6), ("sparse", 0.035, 0.065)],
)
def test_the_share_of_the_cube_that_succeeds_is_as_said(kind: str, low: float, high: float) -> None:
    u = np.random.default_rng(0).random((2000, N))
    shares = [float(KINDS[kind](seed).success(u).mean()) for seed in range(10)]
    assert low < np.mean(shares) < high


@settings(max_examples=20)
@given(SEEDS, st.sampled_from(sorted(KINDS)))
def test_costs_and_chances_stay_within_bounds(seed: int, kind: str) -> None:
    ridge, u = KINDS[kind](seed), np.random.default_rng(seed).random((100, N))
    chance, cost = ridge.success(u), ridge.cost(u)
    assert np.all((chance >= 0.0) & (chance <= 1.0))
    assert np.all((cost > 0.0) & (cost < FAILURE_COST))
    np.testing.assert_allclose(cost, [ridge.cost(row) for row in u])


def test_a_seed_always_makes_the_same_problem() -> None:
    for kind in KINDS:
        one, other = by_name(kind, 3), by_name(kind, 3)
        theta = np.full(N, 0.4)
        draws = [p.trial(theta, np.random.default_rng(1)) for p in (one, other)]
        assert draws[0] == draws[1]
