from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import approx_fprime
from scipy.stats import multivariate_normal

from shearline.learner import Space, create
from shearline.learner.base import Array
from shearline.learner.hireps import (
    HiREPSConfig,
    dual_function,
    first_policy,
    importance,
    log_joint,
    log_shares,
    log_sum,
    refit,
    renew,
)
from shearline.learner.ledger import Trials
from shearline.learner.psp.proposal import Mixture
from shearline.sims.functions import shifted, sphere
from shearline.studies.benchmark import benchmark

RNG = np.random.default_rng(2)
U: Array = RNG.random((60, 3))
REWARD: Array = -np.sum((U - 0.3) ** 2, axis=1)
REWARD = (REWARD - REWARD.max()) / np.ptp(REWARD)
FACTORS: Array = np.array([[[0.3, 0, 0], [0.1, 0.2, 0], [0, 0.05, 0.4]], np.diag([0.2, 0.3, 0.1])])
POLICY = Mixture(np.array([0.3, 0.7]), np.array([[0.2, 0.5, 0.6], [0.7, 0.4, 0.5]]), FACTORS)
EVEN = np.full(60, -np.log(60.0))


def responsibilities() -> Array:
    joint = log_joint(POLICY, U)
    return joint - log_sum(joint, axis=1)[:, None]


def trials(cost: Array, success: bool = True) -> Trials:  # noqa: FBT001, FBT002
    return Trials(np.arange(len(cost)), U, cost, np.full(len(cost), success))


def test_the_density_is_the_one_of_the_library() -> None:
    expected = [
        np.log(w) + multivariate_normal(m, c).logpdf(U)
        for w, m, c in zip(POLICY.weights, POLICY.means, POLICY.covariances, strict=True)
    ]
    np.testing.assert_allclose(log_joint(POLICY, U), np.array(expected).T, atol=1e-9)


def test_samples_of_one_policy_weigh_the_same() -> None:
    np.testing.assert_allclose(importance([POLICY], U), EVEN)


def test_samples_weigh_more_where_the_latest_policy_is_denser() -> None:
    wide = Mixture(np.ones(1), np.full((1, 3), 0.5), 0.5 * np.eye(3)[None])
    weight = importance([wide, POLICY], U)
    ratio = log_sum(log_joint(POLICY, U), axis=1) - log_sum(log_joint(wide, U), axis=1)
    assert np.exp(weight).sum() == pytest.approx(1.0)
    np.testing.assert_array_equal(np.argsort(weight), np.argsort(ratio))


@given(eta=st.floats(0.05, 10.0), xi=st.floats(0.0, 5.0), kappa=st.floats(0.0, 0.7))
@settings(deadline=None)
def test_the_gradient_of_the_dual_is_its_slope(eta: float, xi: float, kappa: float) -> None:
    log_p, config = responsibilities(), HiREPSConfig()

    def dual(x: Array) -> float:
        return dual_function(np.exp(x[0]), x[1], EVEN, log_p, REWARD, config, kappa)[0]

    at = np.array([np.log(eta), xi])
    _, gradient = dual_function(eta, xi, EVEN, log_p, REWARD, config, kappa)
    np.testing.assert_allclose(gradient, approx_fprime(at, dual, 1e-7), rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("information_loss", [0.1, 0.5, 1.0, 2.0])
def test_the_step_loses_as_much_information_as_allowed(information_loss: float) -> None:
    config = HiREPSConfig(information_loss=information_loss, entropy=1.0)
    log_p = responsibilities()
    share = log_shares(EVEN, log_p, REWARD, config)
    loss = np.sum(np.exp(share) * (share - EVEN[:, None] - log_p))
    assert np.exp(share).sum() == pytest.approx(1.0)
    assert loss == pytest.approx(information_loss, rel=0.02)


def test_a_smaller_entropy_pushes_the_options_apart() -> None:
    log_p = responsibilities()
    overlap = []
    for entropy in (1.0, 0.5, 0.2):
        config = HiREPSConfig(information_loss=0.3, entropy=entropy)
        share = np.exp(log_shares(EVEN, log_p, REWARD, config))
        overlap.append(-float(np.sum(share * log_p)))
    kept = -float(np.sum(np.exp(EVEN)[:, None] * np.exp(log_p) * log_p))
    assert overlap[1] <= 0.5 * kept * 1.02
    assert overlap[2] <= 0.2 * kept * 1.02
    assert overlap[2] < overlap[1] <= overlap[0]


def test_a_plain_fit_has_the_weighted_moments() -> None:
    config = HiREPSConfig(memory=0.0, shrinkage=0.0, spread_min=1e-6)
    share = RNG.random((60, 2))
    share /= share.sum()
    found = refit(POLICY, U, share, config)
    np.testing.assert_allclose(found.weights, share.sum(axis=0))
    for k in range(2):
        weight = share[:, k] / share[:, k].sum()
        np.testing.assert_allclose(found.means[k], np.average(U, axis=0, weights=weight))
        covariance = np.cov(U.T, aweights=weight, ddof=0)
        np.testing.assert_allclose(found.covariances[k], covariance, atol=1e-9)


def test_shrinkage_drops_what_lies_off_the_diagonal() -> None:
    share = np.full((60, 2), 1.0 / 120.0)
    full = refit(POLICY, U, share, HiREPSConfig(memory=0.0, shrinkage=0.0)).covariances[0]
    half = refit(POLICY, U, share, HiREPSConfig(memory=0.0, shrinkage=0.5)).covariances[0]
    none = refit(POLICY, U, share, HiREPSConfig(memory=0.0, shrinkage=1.0)).covariances[0]
    np.testing.assert_allclose(np.diag(half), np.diag(full))
    np.testing.assert_allclose(half, (full + np.diag(np.diag(full))) / 2, atol=1e-12)
    assert np.count_nonzero(none) == 3


def test_memory_keeps_an_option_on_one_sample_from_collapsing() -> None:
    share = np.zeros((60, 2))
    share[0] = 0.5
    plain = refit(POLICY, U, share, HiREPSConfig(memory=0.0))
    kept = refit(POLICY, U, share, HiREPSConfig(memory=1.0))
    np.testing.assert_allclose(plain.deviations, 0.005)
    np.testing.assert_allclose(kept.deviations**2, POLICY.deviations**2 / 2 + 0.005**2)


def test_an_option_without_a_share_keeps_its_gaussian() -> None:
    share = np.zeros((60, 2))
    share[:, 0] = 1.0 / 60.0
    found = refit(POLICY, U, share, HiREPSConfig())
    np.testing.assert_array_equal(found.means[1], POLICY.means[1])
    np.testing.assert_allclose(found.covariances[1], POLICY.covariances[1])
    assert 0.0 < found.weights[1] < 1e-5


@pytest.mark.parametrize("success", [True, False])
def test_equal_rewards_leave_the_policy_as_it_is(success: bool) -> None:  # noqa: FBT001
    assert renew([POLICY], trials(np.full(60, 3.0), success), HiREPSConfig()) is POLICY


def test_the_policy_moves_to_where_trials_are_cheap() -> None:
    cost: Array = np.sum((U - 0.3) ** 2, axis=1)
    moved = renew([POLICY], trials(cost), HiREPSConfig())
    before, after = (p.weights @ np.sum((p.means - 0.3) ** 2, axis=1) for p in (POLICY, moved))
    assert after < 0.5 * before


def test_options_begin_at_random_or_in_the_middle() -> None:
    rng = np.random.default_rng(0)
    means = first_policy(3, rng, HiREPSConfig(options=200)).means
    assert means.std() == pytest.approx(np.sqrt(1 / 12), abs=0.03)
    learner = create("hireps", Space.unit(3), 300, seed=0, start="centre", spread=0.1)
    first = np.array([p.theta for p in learner.ask(300)])
    assert first.mean(axis=0) == pytest.approx(0.5, abs=0.03)
    assert first.std(axis=0) == pytest.approx(0.1, abs=0.02)


def test_only_the_latest_episodes_are_weighted_in() -> None:
    """What was told late about an older one than ``history`` says changes nothing."""
    one, other = (create("hireps", Space.unit(3), 10, seed=0, history=1) for _ in range(2))
    for learner in (one, other):
        for _ in range(3):
            for p in learner.ask(10):
                if p.trial:
                    learner.tell(p.trial, cost=float(p.theta.sum()), success=True)
    other.tell(0, cost=-100.0, success=True)
    for a, b in zip(one.ask(10), other.ask(10), strict=True):
        np.testing.assert_array_equal(a.theta, b.theta)


@pytest.mark.slow
def test_the_shifted_sphere_is_reached_as_far_as_documented() -> None:
    [row] = benchmark(["hireps"], lambda seed: shifted(sphere, 20, seed))
    assert row.best <= 14.0
