from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.base import Array
from shearline.learner.ledger import Trials
from shearline.learner.ranked.reliability import Reliability, fit_reliability, sigmoid

SEEDS = st.integers(0, 2**32 - 1)


def tried(seed: int, count: int, n: int = 4) -> Trials:
    """Return trials that succeed near the middle of the cube, more often than not."""
    rng = np.random.default_rng(seed)
    u = rng.random((count, n))
    success = np.linalg.norm(u - 0.5, axis=1) + 0.05 * rng.standard_normal(count) < 0.55
    success[0] = True
    return Trials(np.arange(count), u, np.ones(count), success)


def fitted(trials: Trials) -> Reliability:
    return fit_reliability(trials, trials.where(trials.success))


def middle_and_corner(n: int = 4) -> Array:
    return np.array([np.full(n, 0.5), np.ones(n)])


@given(SEEDS)
def test_probabilities_are_probabilities_and_pessimism_lowers_them(seed: int) -> None:
    trials = tried(seed, 30)
    model, u = fitted(trials), np.random.default_rng(seed).random((20, 4))
    hopeful, wary = model.probability(u), model.probability(u, 1.0)
    assert np.all((wary >= 0.0) & (hopeful <= 1.0))
    assert np.all(wary <= hopeful)


@given(SEEDS)
def test_the_middle_of_what_succeeded_is_more_reliable_than_a_corner(seed: int) -> None:
    middle, corner = fitted(tried(seed, 200)).probability(middle_and_corner())
    assert middle > corner


def test_more_trials_leave_less_doubt() -> None:
    doubt = [
        np.mean([fitted(tried(k, m)).deviation(middle_and_corner())[0] for k in range(20)])
        for m in (20, 100, 500)
    ]
    assert doubt[0] > doubt[1] > doubt[2]


@given(SEEDS, st.booleans())
def test_one_kind_of_outcome_is_no_certainty(seed: int, success: bool) -> None:  # noqa: FBT001
    trials = tried(seed, 30)
    same = Trials(trials.number, trials.u, trials.cost, np.full(30, success))
    p = fit_reliability(same, trials).probability(trials.u)
    assert np.all((p > 0.0) & (p < 1.0))


@pytest.mark.parametrize("seed", range(4))
def test_what_was_seen_while_a_run_was_wide_still_counts_when_it_is_narrow(seed: int) -> None:
    def log_odds(u: Array) -> Array:
        return 1.0 + 8.0 * (u[:, 0] - 0.5) - 6.0 * (u[:, 1] - 0.5)

    rng, centre = np.random.default_rng(seed), np.array([0.75, 0.3, *[0.5] * 10])
    u = np.vstack([rng.random((60, 12)), centre + 0.05 * rng.standard_normal((140, 12))])
    u = np.clip(u, 0.0, 1.0)
    success = rng.random(200) < 1.0 / (1.0 + np.exp(-log_odds(u)))
    fresh = centre + 0.1 * rng.standard_normal((200, 12))
    p = fitted(Trials(np.arange(200), u, np.ones(200), success)).probability(fresh)
    assert np.corrcoef(p, log_odds(fresh))[0, 1] > 0.4


@given(SEEDS)
def test_a_snapshot_is_the_same_function_written_around_the_middle(seed: int) -> None:
    model, u = fitted(tried(seed, 50)), np.random.default_rng(seed).random((20, 4))
    said: dict[str, Any] = dict(model.snapshot())
    z = (u - np.array(said["centre"])) / np.array(said["scale"])
    square = z**2 - 1.0
    phi = np.hstack([np.ones((20, 1)), square.mean(axis=1, keepdims=True), z, square])
    np.testing.assert_allclose(sigmoid(phi @ said["weights"]), model.probability(u), rtol=1e-9)


@given(SEEDS)
def test_the_order_of_parameters_means_nothing(seed: int) -> None:
    trials, order = tried(seed, 40), np.array([2, 0, 3, 1])
    turned = Trials(trials.number, trials.u[:, order], trials.cost, trials.success)
    np.testing.assert_allclose(
        fitted(turned).probability(turned.u), fitted(trials).probability(trials.u), rtol=1e-4
    )
