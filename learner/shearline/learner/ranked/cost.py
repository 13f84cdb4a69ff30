"""What a success costs: a Gaussian process with a separable quadratic trend.

Its kernel is a sum: a quadratic in each parameter, a free curve in each parameter, and a smooth
function of all of them. How much of each there is, is what makes the data most likely, so a bowl
is found to be a bowl and a noisy heap of costs stays a heap. It knows successes only.

Rasmussen and Williams (2006), chapters 2 and 5; sums of curves: Duvenaud et al. (2011), Additive
Gaussian processes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shearline.learner.base import Array

#: Lengths tried for the curves in single parameters, in half edges of the cube.
CURVE_LENGTHS = (0.06, 0.2)
#: Bounds of log variances (costs are standardised) and of the log length of the smooth part.
LOG_VARIANCE = (-16.0, 5.0)
LOG_LENGTH = (-1.0, 3.0)
SEARCH_ROUNDS = 25
#: Before anything is seen: centres and deviations of the log parts and of the log length. Half of
#: the variance is noise, a tenth for each parameter a quadratic: a few dozen costs that are mostly
#: noise do not say by themselves how much of them is, and the likeliest answer is too often all.
PRIOR_CENTRE = np.array([-2.3, -4.0, -2.0, -0.7, 1.0])
PRIOR_SPREAD = np.array([2.0, 8.0, 2.0, 2.0, 2.0])


@dataclass(frozen=True, slots=True)
class Cost:
    """Posterior mean and deviation of the standardised, warped cost.

    Attributes:
        x: Successes ``(m, n)`` in half edges from the middle.
        weights: Kernel weights ``(m,)``.
        factor: Inverse of the Cholesky factor of their covariance ``(m, m)``.
        parts: Log variances of square, curve, smooth, noise, and log length of the smooth part.
        curve: Length of the curves.
        offset: Mean of the warped costs.
        unit: Their standard deviation.
        log_floor: What is added to a cost before its logarithm is taken; ``nan`` for none.
    """

    x: Array
    weights: Array
    factor: Array
    parts: Array
    curve: float
    offset: float
    unit: float
    log_floor: float

    @property
    def noise(self) -> float:
        """Share of the (warped) costs' variance that the process does not explain, 0 to 1."""
        return min(1.0, float(np.exp(self.parts[3])))

    def mean(self, u: Array) -> Array:
        """Return the expected cost (the median, where logarithms are used) of ``(m, n)``."""
        return self._unwarp(self._cross(2.0 * u - 1.0) @ self.weights)

    def at(self, u: Array, pessimism: float) -> Array:
        """Return the cost ``(m,)`` so many standard deviations above the mean."""
        cross = self._cross(2.0 * u - 1.0)
        return self._unwarp(cross @ self.weights + pessimism * self._deviation(u, cross))

    def deviation(self, u: Array) -> Array:
        """Return the posterior deviation ``(m,)`` of the warped cost, in units of its spread."""
        return self._deviation(u, self._cross(2.0 * u - 1.0))

    def _cross(self, x: Array) -> Array:
        return _sum(_parts(x, self.x, (self.curve,))[0], self.parts)

    def _deviation(self, u: Array, cross: Array) -> Array:
        x = 2.0 * u - 1.0
        square, curve, smooth = np.exp(self.parts[:3])
        prior = square * np.sum(x**2 + x**4, axis=1) + curve + smooth
        explained = np.sum((cross @ self.factor.T) ** 2, axis=1)
        deviation: Array = np.sqrt(np.maximum(prior - explained, 0.0))
        return deviation

    def _unwarp(self, value: Array) -> Array:
        cost: Array = self.offset + self.unit * value
        if not np.isnan(self.log_floor):
            cost = np.asarray(np.exp(cost) - self.log_floor, dtype=np.float64)
        return cost


def fit_cost(u: Array, cost: Array) -> Cost:
    """Fit the process; whether to costs or to their logarithms is decided by likelihood.

    Args:
        u: Successes ``(m, n)`` in unit coordinates, m >= 1.
        cost: Their costs ``(m,)``, finite.
    """
    x = 2.0 * u - 1.0
    least, spread = float(cost.min()), float(cost.max() - cost.min())
    if spread <= 1e-9 * max(abs(least), 1e-300):
        return _constant(x, least)
    parts = _parts(x, x, CURVE_LENGTHS)
    floor = 0.02 * spread - least
    plain, logarithmic = cost, np.log(cost + floor)
    n = x.shape[1]
    start = np.array([-np.log(n), -2.0, -1.0, -2.0, 0.5 * np.log(n)])
    first = _search(x, plain, parts[0], CURVE_LENGTHS[0], np.nan, start)
    second = _search(x, logarithmic, parts[0], CURVE_LENGTHS[0], floor, start)
    # Densities of the same costs: the logarithm's Jacobian counts.
    if first[0] >= second[0] - float(logarithmic.sum()):
        best, y, log_floor = first, plain, np.nan
    else:
        best, y, log_floor = second, logarithmic, floor
    for k, length in enumerate(CURVE_LENGTHS[1:], 1):
        other = _search(x, y, parts[k], length, log_floor, best[1].parts)
        best = max(best, other, key=lambda found: found[0])
    return best[1]


def _constant(x: Array, cost: float) -> Cost:
    parts = np.array([LOG_VARIANCE[0], LOG_VARIANCE[0], LOG_VARIANCE[0], 0.0, 0.0])
    m = len(x)
    return Cost(x, np.zeros(m), np.eye(m), parts, CURVE_LENGTHS[0], cost, 0.0, np.nan)


Parts = tuple[Array, Array, Array]


def _parts(a: Array, b: Array, lengths: Sequence[float]) -> list[Parts]:
    """Return for each curve length: quadratic, curve kernel, squared distances, ``(m, k)``."""
    square = a @ b.T + (a**2) @ (b**2).T
    distance = np.sum(a**2, 1)[:, None] + np.sum(b**2, 1)[None, :] - 2.0 * (a @ b.T)
    distance = np.maximum(distance, 0.0)
    gap = np.square(a[:, None, :] - b[None, :, :])
    return [(square, np.mean(np.exp(-0.5 * gap / s**2), axis=2), distance) for s in lengths]


def _sum(parts: Parts, log: Array) -> Array:
    square, curve, distance = parts
    smooth = np.exp(log[2] - 0.5 * distance * np.exp(-2.0 * log[4]))
    result: Array = np.exp(log[0]) * square + np.exp(log[1]) * curve + smooth
    return result


def _search(
    x: Array, y: Array, parts: Parts, curve: float, log_floor: float, start: Array
) -> tuple[float, Cost]:
    """Return the log density of the data and the process of the likeliest parts."""
    from scipy.optimize import minimize  # noqa: PLC0415 - heavy, at the first fit

    offset, unit = float(y.mean()), max(float(y.std()), 1e-300)
    target = (y - offset) / unit
    found = minimize(
        _loss,
        start,
        (parts, target),
        "L-BFGS-B",
        jac=True,
        bounds=[*[LOG_VARIANCE] * 4, LOG_LENGTH],
        options={"maxiter": SEARCH_ROUNDS},
    )
    factor = np.linalg.inv(np.linalg.cholesky(_noisy(parts, found.x)))
    weights = factor.T @ (factor @ target)
    process = Cost(x, weights, factor, found.x, curve, offset, unit, log_floor)
    return -float(found.fun) - len(y) * float(np.log(unit)), process


def _noisy(parts: Parts, log: Array) -> Array:
    covariance = _sum(parts, log)
    covariance[np.diag_indices_from(covariance)] += np.exp(log[3]) + 1e-8
    return covariance


def _loss(log: Array, parts: Parts, target: Array) -> tuple[float, Array]:
    """Return the negative log posterior of the log parts and its gradient."""
    square, curve, distance = parts
    smooth = np.exp(log[2] - 0.5 * distance * np.exp(-2.0 * log[4]))
    covariance = np.exp(log[0]) * square + np.exp(log[1]) * curve + smooth
    covariance[np.diag_indices_from(covariance)] += np.exp(log[3]) + 1e-8
    factor, inverse = _inverted(covariance)
    weights = inverse @ target
    slope = 0.5 * (inverse - np.outer(weights, weights))
    gradient = np.array(
        [
            np.exp(log[0]) * np.sum(slope * square),
            np.exp(log[1]) * np.sum(slope * curve),
            np.sum(slope * smooth),
            np.exp(log[3]) * np.trace(slope),
            np.sum(slope * smooth * distance) * np.exp(-2.0 * log[4]),
        ]
    )
    loss = 0.5 * float(target @ weights) + float(np.sum(np.log(np.diag(factor))))
    away = (log - PRIOR_CENTRE) / PRIOR_SPREAD
    return loss + 0.5 * float(away @ away), gradient + away / PRIOR_SPREAD


def _inverted(covariance: Array) -> tuple[Array, Array]:
    """Return the upper Cholesky factor and the inverse of a positive definite matrix."""
    from scipy.linalg.lapack import dpotrf, dpotri  # noqa: PLC0415 - heavy, at the first fit

    factor, _ = dpotrf(covariance)
    upper, _ = dpotri(factor)
    inverse: Array = np.triu(upper) + np.triu(upper, 1).T
    return factor, inverse
