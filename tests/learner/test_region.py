from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.region import Region, fold
from shearline.protocol.space import Array, Space


def region(centre: Array, radius: Array) -> Region:
    n = len(centre)
    space = Space({f"x{i}": ("N", 0.0, 10.0) for i in range(n)})
    return Region(space, centre, radius, 0.9, 0.95, 60, 58)


@st.composite
def regions(draw: st.DrawFn) -> Region:
    n = draw(st.integers(1, 30))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    widest = draw(st.sampled_from((0.1, 3.0, 50.0)))
    return region(rng.uniform(0.0, 10.0, n), rng.uniform(0.01, widest, n))


@given(region=regions(), seed=st.integers(0, 1000))
def test_every_draw_lies_inside(region: Region, seed: int) -> None:
    draws = region.sample(np.random.default_rng(seed), 50)
    assert draws.shape == (50, len(region.space))
    assert all(region.contains(theta) for theta in draws)


@given(regions(), st.integers(0, 1000))
def test_the_same_generator_gives_the_same_draws(one: Region, seed: int) -> None:
    first, second = (one.sample(np.random.default_rng(seed), 3) for _ in range(2))
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("n", [1, 2, 23])
def test_draws_fill_the_ellipsoid_evenly(n: int) -> None:
    """The share within a fraction r of the radius is r^n; each axis has variance r^2 / (n + 2)."""
    one = region(np.full(n, 5.0), np.linspace(1.0, 3.0, n))
    draws = one.sample(np.random.default_rng(1), 20_000)
    half = 0.5 ** (1 / n)
    assert np.mean(one.distance(draws) <= half) == pytest.approx(0.5, abs=0.02)
    np.testing.assert_allclose(draws.var(axis=0), one.radius**2 / (n + 2), rtol=0.06)


def test_what_is_out_of_bounds_is_not_inside() -> None:
    one = region(np.array([0.5, 5.0]), np.array([2.0, 1.0]))
    assert one.contains(np.array([0.0, 5.0]))
    assert not one.contains(np.array([-0.1, 5.0]))
    assert not one.contains(np.array([2.4, 5.4]))
    assert not one.contains(np.array([np.nan, 5.0]))


@given(u=st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=5), centre=st.floats(0.0, 1.0))
def test_folding_stays_in_the_cube_and_comes_nearer_to_what_is_in_it(
    u: list[float], centre: float
) -> None:
    folded = fold(np.array(u))
    assert np.all((folded >= 0.0) & (folded <= 1.0))
    assert np.all(np.abs(folded - centre) <= np.abs(np.array(u) - centre) + 1e-12)
