from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from shearline.learner.psp.config import Covariance, Outside, PSPConfig
from shearline.learner.psp.proposal import Mixture, draw_inside, fit_mixture, reflect

DIAGONAL = PSPConfig()
FULL = PSPConfig(covariance=Covariance.FULL)


def clusters(
    seed: int = 0, spread: float = 0.03
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    rng = np.random.default_rng(seed)
    return np.concatenate(
        [0.2 + spread * rng.standard_normal((40, 3)), 0.8 + spread * rng.standard_normal((40, 3))]
    )


@given(hnp.arrays(np.float64, (4, 3), elements=st.floats(-50.0, 50.0)))
def test_reflection_ends_in_the_cube_and_leaves_its_points_alone(
    u: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
) -> None:
    folded = reflect(u)
    assert np.all((folded >= 0.0) & (folded <= 1.0))
    inside = (u >= 0.0) & (u <= 1.0)
    np.testing.assert_array_equal(folded[inside], u[inside])
    np.testing.assert_allclose(reflect(-u), folded, atol=1e-12)


@pytest.mark.parametrize("config", [DIAGONAL, FULL])
def test_two_clusters_are_two_components_by_bic(config: PSPConfig) -> None:
    mixture, components = fit_mixture(clusters(), None, 0, config)
    assert components == 2
    assert np.sort(mixture.means.mean(axis=1)) == pytest.approx([0.2, 0.8], abs=0.02)
    assert mixture.nearest(clusters(1)).tolist() in ([0] * 40 + [1] * 40, [1] * 40 + [0] * 40)


def test_a_frozen_component_count_is_kept_where_bic_would_choose_another() -> None:
    mixture, components = fit_mixture(clusters(), 3, 0, DIAGONAL)
    assert components == 3
    assert len(mixture.weights) == 3


def test_never_more_components_than_distinct_samples_and_the_count_survives() -> None:
    u = np.array([[0.2, 0.2], [0.7, 0.7], [0.7, 0.7]])
    mixture, components = fit_mixture(u, 3, 0, DIAGONAL)
    assert len(mixture.weights) == 2
    assert components == 3


@pytest.mark.parametrize("config", [DIAGONAL, FULL])
def test_coinciding_samples_make_one_component_as_wide_as_the_floor(config: PSPConfig) -> None:
    mixture, _ = fit_mixture(np.full((5, 3), 0.4), None, 0, config)
    np.testing.assert_allclose(mixture.means, [[0.4, 0.4, 0.4]])
    np.testing.assert_allclose(mixture.deviations, config.covariance_floor)


def test_full_components_on_fewer_samples_than_parameters_can_be_drawn_from() -> None:
    u = np.random.default_rng(0).random((6, 30))
    mixture, _ = fit_mixture(u, 1, 0, FULL)
    assert np.isfinite(mixture.draw(np.random.default_rng(0), 10)).all()


def test_draws_have_the_moments_of_the_mixture() -> None:
    factors = np.array([[[0.1, 0.0], [0.05, 0.02]], [[0.03, 0.0], [0.0, 0.08]]])
    mixture = Mixture(np.array([0.3, 0.7]), np.array([[0.2, 0.5], [0.6, 0.1]]), factors)
    draws = mixture.draw(np.random.default_rng(1), 200_000)
    mean = mixture.weights @ mixture.means
    offsets = mixture.means - mean
    covariance = np.einsum(
        "k,kij->ij", mixture.weights, mixture.covariances + offsets[:, :, None] * offsets[:, None]
    )
    np.testing.assert_allclose(draws.mean(axis=0), mean, atol=2e-3)
    np.testing.assert_allclose(np.cov(draws.T), covariance, atol=5e-4)


@pytest.mark.parametrize("outside", list(Outside))
def test_draws_stay_in_the_cube(outside: Outside) -> None:
    mixture = Mixture(np.ones(1), np.array([[0.02, 0.98]]), 0.2 * np.eye(2)[None])
    u = draw_inside(mixture, np.random.default_rng(0), 2000, outside)
    assert np.all((u >= 0.0) & (u <= 1.0))
    on_wall = np.mean((u == 0.0) | (u == 1.0))
    assert (on_wall > 0.3) == (outside is Outside.CLIP)


def test_the_spread_switch_scales_what_is_drawn() -> None:
    wide, _ = fit_mixture(clusters(), 2, 0, PSPConfig(spread=2.0))
    plain, _ = fit_mixture(clusters(), 2, 0, DIAGONAL)
    np.testing.assert_allclose(wide.deviations, 2.0 * plain.deviations)
