"""How likely a tuple succeeds: Bayesian logistic regression on the cube.

The log-odds of success are a quadratic in each parameter, measured in half edges of the cube, and
a multiple of how far out the tuple lies from the middle of the successes, in their own deviations.
The curves keep their unit however far a run has narrowed, so that what was seen when it was wide
still counts; the distance is what is known best with a handful of trials for each parameter. It
knows tuples and outcomes, no costs.

The posterior is Laplace's approximation (Bishop 2006, section 4.5).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.ledger import Trials

#: Steps of Newton, at most.
NEWTON_STEPS = 12
#: Precision of the prior on the intercept and on the distance: log-odds of some units either way.
WIDE = 0.05
#: Precision of the weights of one parameter: log-odds of about one unit for half an edge.
EACH = 1.0
#: Least length that counts as one deviation of the successes, in edges of the cube: a run that has
#: narrowed to nothing does not take all that it saw before for far away.
SCALE_MIN = 0.05
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
        """Return the log-odds as plain values, as one sum over ``z = (u - centre) / scale``.

        ``w_0 + w_1 mean(z^2 - 1) + sum_j (a_j z_j + b_j (z_j^2 - 1))`` with the weights ``w_0, w_1,
        a, b``: the form that reports draw. It parts the space where success and failure are equally
        likely.
        """
        return {
            "kind": "log-odds",
            "centre": self.centre.tolist(),
            "scale": self.scale.tolist(),
            "weights": self._around_centre().tolist(),
        }

    def _around_centre(self) -> Array:
        """Return the weights ``(2 + 2 n,)`` of z, with ``x = x_c + 2 scale z``."""
        n = len(self.centre)
        at, step = 2.0 * self.centre - 1.0, 2.0 * self.scale
        line, curve = self.mean[2 : 2 + n], self.mean[2 + n :]
        constant = self.mean[0] + line @ at + curve @ (at**2 + step**2 - 1.0 / 3.0)
        slopes = step * (line + 2.0 * curve * at)
        return np.hstack([constant, self.mean[1], slopes, curve * step**2])

    def _deviation(self, phi: Array) -> Array:
        variance: Array = np.sum((phi @ self.covariance) * phi, axis=1)
        return np.sqrt(np.maximum(variance, 0.0))


def features(u: Array, centre: Array, scale: Array) -> Array:
    """Return ``[1, mean(z^2 - 1), x, x^2 - 1/3]``.

    ``z = (u - centre) / scale`` and ``x = 2 u - 1``, whose square has the mean 1/3 over the cube.

    Args:
        u: Tuples ``(m, n)``.
        centre: ``(n,)``.
        scale: ``(n,)``.

    Returns:
        ``(m, 2 + 2 n)``.
    """
    x = 2.0 * u - 1.0
    out = np.mean(np.square((u - centre) / scale) - 1.0, axis=1, keepdims=True)
    return np.hstack([np.ones((len(u), 1)), out, x, np.square(x) - 1.0 / 3.0])


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
    precision = np.full(phi.shape[1], EACH)
    precision[:2] = WIDE
    mean, covariance = _laplace(phi, success, precision)
    return Reliability(centre, scale, mean, covariance)


def _laplace(phi: Array, success: npt.NDArray[np.bool_], precision: Array) -> tuple[Array, Array]:
    """Return mode ``(f,)`` and inverse curvature ``(f, f)`` of the log posterior."""
    mean = np.zeros(phi.shape[1])
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
