"""Hierarchical relative entropy policy search (HiREPS), the paper's appendix A.1.

Daniel, Neumann and Peters (2012), AISTATS 22:273-281. A policy is a set of options, each a
Gaussian; an update raises the expected reward while it stays close to what was sampled. Here an
episode has one state, so that their features of the state, theta in the paper, are a constant
that the normalisation absorbs. This knows trials and Gaussians, no partition.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shearline.learner.base import Array
from shearline.learner.charge import Failures, charged
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.ledger import Trials
from shearline.learner.psp.config import Outside
from shearline.learner.psp.focus import component_focus
from shearline.learner.psp.proposal import Mixture, draw_inside
from shearline.learner.recommend import Focus
from shearline.learner.switches import check, having, plain
from shearline.learner.threads import fitting
from shearline.protocol.space import Space

#: What a renewal needs.
LIBRARIES = ("scipy.optimize",)

#: Bounds of the multiplier eta; rewards are scaled to a span of 1 before they are divided by it.
ETA_MIN, ETA_MAX = 1e-4, 1e4
#: Bound of the multiplier xi of the entropy constraint.
XI_MAX = 1e4
#: An option with a smaller share keeps its Gaussian: there is nothing to fit one to.
SHARE_MIN = 1e-3
#: Least chance of an option, so that its logarithm stays a number.
CHANCE_MIN = 1e-6


class Start(enum.StrEnum):
    """Where the options begin."""

    RANDOM = "random"  # "n Gaussians with random mean"
    CENTRE = "centre"  # the middle of the box: the bias that the paper's section 4.1 speaks of


@dataclass(frozen=True, slots=True)
class HiREPSConfig:
    """What appendix A.1 leaves open; it gives no number at all.

    Attributes:
        options: n, Gaussians of the policy.
        information_loss: epsilon, most relative entropy [nat] between the new policy and the
            samples; 1 is usual for REPS. Half of it is slower; twice as much is faster as long
            as ``memory`` keeps the options from collapsing.
        entropy: kappa, share of the present entropy of the options' responsibilities that the
            new policy may keep, 0 to 1; below 1 pushes options apart.
        history: H, earlier episodes that are weighted in.
        start: Where the options' means begin.
        spread: Their standard deviation at the start, in units of the cube's edge.
        shrinkage: Share of a covariance's off-diagonal elements that is dropped; 1 leaves a
            diagonal, which 40 samples in 20 dimensions can support.
        memory: Samples that an option's old covariance counts for; keeps a Gaussian on a few
            heavy samples from collapsing. 0 is the plain weighted fit.
        spread_min: Standard deviation that is added to every axis, in units of the edge.
        failures: Whether failures differ among themselves.
    """

    options: int = 2
    information_loss: float = 1.0
    entropy: float = 0.9
    history: int = 3
    start: Start = Start.RANDOM
    spread: float = 0.3
    shrinkage: float = 1.0
    memory: float = 3.0
    spread_min: float = 0.005
    failures: Failures = Failures.ALIKE

    def __post_init__(self) -> None:
        _check(self.options >= 1, "options", "1 or more", self.options)
        _check(self.information_loss > 0, "information_loss", "above 0", self.information_loss)
        _check(0 <= self.entropy <= 1, "entropy", "0 to 1", self.entropy)
        _check(self.history >= 0, "history", "0 or more", self.history)
        _check(self.spread > 0, "spread", "above 0", self.spread)
        _check(0 <= self.shrinkage <= 1, "shrinkage", "0 to 1", self.shrinkage)
        _check(self.memory >= 0, "memory", "0 or more", self.memory)
        _check(self.spread_min > 0, "spread_min", "above 0", self.spread_min)


def _check(holds: bool, name: str, expected: str, got: object) -> None:  # noqa: FBT001 - as in an assertion
    check(holds, "hireps", name, expected, got)


class HiREPS(EpisodicLearner):
    """Options that follow the reward, no further at a time than the samples reach.

    After another run the first policy is already one update on, by that run's trials.

    Args:
        space: What is being learned.
        episode_length: N, trials between two updates.
        seed: 0 or more.
        switches: Fields of :class:`HiREPSConfig`.
    """

    name = "hireps"
    primes = True
    libraries = LIBRARIES

    def __init__(
        self, space: Space, episode_length: int = 20, seed: int = 0, **switches: object
    ) -> None:
        super().__init__(space, episode_length, seed)
        self.config = having(HiREPSConfig(), self.name, switches)
        self._policies: list[Mixture] = []

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        if episode == 0:
            self._policies = [first_policy(len(self.space), rng, self.config)]
            if len(trials):
                with fitting(*LIBRARIES):
                    self._policies = [renew(self._policies, trials, self.config)]
        else:
            self._policies.append(self._renewed(trials))

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        del index
        return np.array(draw_inside(self._policies[-1], rng, 1, Outside.REFLECT)[0])

    def _renewed(self, trials: Trials) -> Mixture:
        """Return the next policy; the present one learns from episodes k - H to k."""
        oldest = max(0, len(self._policies) - 1 - self.config.history)
        recent = trials.where(trials.number >= oldest * self.episode_length)
        with fitting(*LIBRARIES):
            return renew(self._policies[oldest:], recent, self.config)

    def _focus(self, trials: Trials) -> Focus:
        """Return the option that the next episode would best stay with."""
        if not trials.success.any():
            return super()._focus(trials)
        return component_focus(self._renewed(trials), trials)

    def _model(self) -> Mapping[str, object]:
        policy = dict(self._policies[-1].snapshot()) if self._policies else None
        return {"config": plain(self.config), "mixture": policy}


def first_policy(n: int, rng: np.random.Generator, config: HiREPSConfig) -> Mixture:
    """Return equally likely options around random tuples, or around the middle of the cube."""
    means = rng.random((config.options, n))
    if config.start is Start.CENTRE:
        means = np.full((config.options, n), 0.5)
    factors = np.tile(config.spread * np.eye(n), (config.options, 1, 1))
    return Mixture(np.full(config.options, 1.0 / config.options), means, factors)


def renew(policies: Sequence[Mixture], trials: Trials, config: HiREPSConfig) -> Mixture:
    """Return the policy that follows the last of some policies.

    Args:
        policies: Those that the trials were drawn from, oldest first.
        trials: m trials.
        config: The reading of the appendix.

    Returns:
        The weighted fit of every option; the last policy itself where all rewards are equal.
    """
    reward = -charged(trials, config.failures)
    if not len(trials) or np.ptp(reward) == 0.0:
        return policies[-1]
    joint = log_joint(policies[-1], trials.u)
    chance = joint - log_sum(joint, axis=1)[:, None]
    share = np.exp(
        log_shares(
            importance(policies, trials.u),
            chance,
            (reward - reward.max()) / float(np.ptp(reward)),
            config,
        )
    )
    return refit(policies[-1], trials.u, share, config)


def log_joint(policy: Mixture, u: Array) -> Array:
    """Return the log of option chance times density ``(m, k)`` of tuples ``(m, n)``."""
    offset = u[None] - policy.means[:, None]
    white = np.linalg.solve(policy.factors, offset.transpose(0, 2, 1))
    log_volume = np.linalg.slogdet(policy.factors)[1] + 0.5 * u.shape[1] * np.log(2.0 * np.pi)
    result: Array = np.log(policy.weights) - 0.5 * np.sum(white**2, axis=1).T - log_volume
    return result


def importance(policies: Sequence[Mixture], u: Array) -> Array:
    """Return ``log v`` of tuples ``(m, n)`` as ``(m,)``; the weights sum to 1.

    ``v_i = q_k(a_i) / sum_h q_h(a_i)`` over the policies, the last of which is q_k.
    """
    density = np.array([log_sum(log_joint(policy, u), axis=1) for policy in policies])
    weight: Array = density[-1] - log_sum(density, axis=0)
    return weight - log_sum(weight, axis=0)


def log_shares(log_v: Array, log_p: Array, reward: Array, config: HiREPSConfig) -> Array:
    """Return the log of ``p(a_i, o)``, ``(m, k)``, at the minimum of the dual function.

    Args:
        log_v: Log importance weights ``(m,)``.
        log_p: Log of the options' responsibilities ``(m, k)``.
        reward: Rewards ``(m,)`` with a span of 1.
        config: Bounds on information loss and entropy.
    """
    from scipy.optimize import minimize  # noqa: PLC0415 - heavy, at the first update

    responsibility = np.exp(log_v)[:, None] * np.exp(log_p)
    kept = config.entropy * -float(np.sum(responsibility * log_p))

    def dual(x: Array) -> tuple[float, Array]:
        return dual_function(float(np.exp(x[0])), float(x[1]), log_v, log_p, reward, config, kept)

    bounds = [(np.log(ETA_MIN), np.log(ETA_MAX)), (0.0, XI_MAX if log_p.shape[1] > 1 else 0.0)]
    found = minimize(dual, [np.log(0.1), 0.0], jac=True, bounds=bounds, method="L-BFGS-B")
    eta, xi = float(np.exp(found.x[0])), float(found.x[1])
    exponent = log_v[:, None] + (1.0 + xi / eta) * log_p + reward[:, None] / eta
    result: Array = exponent - log_sum(exponent.ravel(), axis=0)
    return result


def dual_function(
    eta: float,
    xi: float,
    log_v: Array,
    log_p: Array,
    reward: Array,
    config: HiREPSConfig,
    entropy: float,
) -> tuple[float, Array]:
    """Return the dual function and its gradient by ``(log eta, xi)``.

    ``g = eta epsilon + xi kappa + eta log sum_i,o v_i p(o|a_i)^(1 + xi/eta) exp(R_i / eta)``: the
    multipliers eta of the information loss and xi of the entropy, which the paper's algorithm 2
    calls epsilon as well. It is convex in both.
    """
    exponent = log_v[:, None] + (1.0 + xi / eta) * log_p + reward[:, None] / eta
    log_total = float(log_sum(exponent.ravel(), axis=0))
    share = np.exp(exponent - log_total)
    log_p_mean = float(np.sum(share * log_p))
    reward_mean = float(np.sum(share * reward[:, None]))
    value = eta * (config.information_loss + log_total) + xi * entropy
    by_eta = config.information_loss + log_total - (xi * log_p_mean + reward_mean) / eta
    return value, np.array([eta * by_eta, entropy + log_p_mean])


def refit(policy: Mixture, u: Array, share: Array, config: HiREPSConfig) -> Mixture:
    """Return the options fitted to tuples ``(m, n)`` with shares ``(m, k)`` that sum to 1."""
    chance = share.sum(axis=0)
    means, factors = policy.means.copy(), policy.factors.copy()
    for k in np.flatnonzero(chance > SHARE_MIN):
        means[k], covariance = _gaussian(u, share[:, k] / chance[k], policy.covariances[k], config)
        factors[k] = np.linalg.cholesky(covariance)
    weights = np.maximum(chance, CHANCE_MIN)
    return Mixture(weights / weights.sum(), means, factors)


def _gaussian(u: Array, weight: Array, old: Array, config: HiREPSConfig) -> tuple[Array, Array]:
    """Return mean ``(n,)`` and covariance ``(n, n)`` of tuples with weights that sum to 1."""
    mean = weight @ u
    offset = u - mean
    covariance = (weight[:, None] * offset).T @ offset
    covariance += config.shrinkage * (np.diag(np.diag(covariance)) - covariance)
    samples = 1.0 / float(np.sum(weight**2))
    covariance += config.memory / (config.memory + samples) * (old - covariance)
    return mean, covariance + config.spread_min**2 * np.eye(u.shape[1])


def log_sum(a: Array, axis: int) -> Array:
    """Return ``log sum exp`` along an axis."""
    top = np.max(a, axis=axis, keepdims=True)
    result: Array = np.squeeze(
        top + np.log(np.sum(np.exp(a - top), axis=axis, keepdims=True)), axis
    )
    return result
