"""How likely a tuple succeeds: Bayesian logistic regression around the middle of the successes.

With a handful of trials for each parameter, what is best known about success is how far out it
reaches: the distance from the middle of the successes, in their own deviations, gets a weight of
its own with a wide prior. Each parameter and its square may depart from that, under a prior that
keeps the many small departures small and lets a few be large. It knows tuples and outcomes, no
costs.

The posterior is Laplace's approximation (Bishop 2006, section 4.5). The departures have Student's
distribution, each with a precision of its own that is found by expectation maximisation
(Tipping 2001, JMLR 1:211-244).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.ledger import Trials

#: Steps of Newton, and rounds in which the prior is renewed after them.
NEWTON_STEPS = 12
PRIOR_ROUNDS = 4
#: Precision of the prior on the intercept and on the distance: log-odds of some units either way.
WIDE = 0.05
#: Precision of a departure before anything is known: little next to the distance.
NARROW = 300.0
#: Shape of the prior on that precision; the smaller, the more departures may be large.
SHAPE = 1.0
#: Least length that counts as one deviation of the successes, in edges of the cube.
SCALE_MIN = 1e-3
#: Log-odds beyond this change no decision and only lose digits.
LOGIT_MAX = 30.0


@dataclass(frozen=True, slots=True)
class Reliability:
    """Posterior of the log-odds of success, linear in features of the tuple.

    Attributes:
        centre: Middle of the successes ``(n,)`` in unit coordinates.
        scale: Their deviations ``(n,)``.
        mean: Weights ``(2 + 2 n,)``.
        covariance: Their covariance.
    """

    centre: Array
    scale: Array
    mean: Array
    covariance: Array

    def probability(self, u: Array, pessimism: float = 0.0) -> Array:
        """Return the chance of success of tuples ``(m, n)`` as ``(m,)``.

        Args:
            u: Tuples in unit coordinates.
            pessimism: Standard deviations by which the log-odds are taken below their mean.
        """
        phi = features(u, self.centre, self.scale)
        return sigmoid(phi @ self.mean - pessimism * self._deviation(phi))

    def deviation(self, u: Array) -> Array:
        """Return the posterior's standard deviation ``(m,)`` of the log-odds."""
        return self._deviation(features(u, self.centre, self.scale))

    def snapshot(self) -> Mapping[str, object]:
        """Return the log-odds as plain values; ``weights`` belong to :func:`features`.

        It parts the space where success and failure are equally likely.
        """
        return {
            "kind": "log-odds",
            "centre": self.centre.tolist(),
            "scale": self.scale.tolist(),
            "weights": self.mean.tolist(),
        }

    def _deviation(self, phi: Array) -> Array:
        variance: Array = np.sum((phi @ self.covariance) * phi, axis=1)
        return np.sqrt(np.maximum(variance, 0.0))


def features(u: Array, centre: Array, scale: Array) -> Array:
    """Return ``[1, mean(z^2 - 1), z, z^2 - 1]`` with ``z = (u - centre) / scale``.

    Args:
        u: Tuples ``(m, n)``.
        centre: ``(n,)``.
        scale: ``(n,)``.

    Returns:
        ``(m, 2 + 2 n)``.
    """
    z = (u - centre) / scale
    square = np.square(z) - 1.0
    return np.hstack([np.ones((len(u), 1)), square.mean(axis=1, keepdims=True), z, square])


def sigmoid(logit: Array) -> Array:
    """Return ``1 / (1 + exp(-logit))``."""
    result: Array = 1.0 / (1.0 + np.exp(-np.clip(logit, -LOGIT_MAX, LOGIT_MAX)))
    return result


def fit_reliability(seen: Trials, won: Trials) -> Reliability:
    """Fit the posterior.

    Args:
        seen: What it rests on, m trials.
        won: Successes whose middle and deviations it is measured by; at least one.
    """
    centre, scale = won.u.mean(axis=0), np.maximum(won.u.std(axis=0), SCALE_MIN)
    phi, success = features(seen.u, centre, scale), seen.success
    precision = np.full(phi.shape[1], NARROW)
    precision[:2] = WIDE
    mean = np.zeros(phi.shape[1])
    for _ in range(PRIOR_ROUNDS):
        mean, covariance = _laplace(phi, success, mean, precision)
        size = np.square(mean) + np.diag(covariance)
        precision[2:] = ((2.0 * SHAPE + 1.0) / (size + 2.0 * SHAPE / NARROW))[2:]
    return Reliability(centre, scale, mean, covariance)


def _laplace(
    phi: Array, success: npt.NDArray[np.bool_], mean: Array, precision: Array
) -> tuple[Array, Array]:
    """Return mode ``(f,)`` and inverse curvature ``(f, f)`` of the log posterior."""
    for _ in range(NEWTON_STEPS):
        p = sigmoid(phi @ mean)
        step = np.linalg.solve(
            _curvature(phi, p, precision), phi.T @ (success - p) - precision * mean
        )
        # The log posterior is concave; a long first step on few data is what could overshoot.
        mean = mean + step * min(1.0, 5.0 / max(float(np.abs(step).max()), 1e-12))
        if float(np.abs(step).max()) < 1e-6:
            break
    covariance = np.linalg.inv(_curvature(phi, sigmoid(phi @ mean), precision))
    return mean, covariance.astype(np.float64, copy=False)


def _curvature(phi: Array, p: Array, precision: Array) -> Array:
    result: Array = (phi.T * (p * (1.0 - p))) @ phi + np.diag(precision)
    return result
