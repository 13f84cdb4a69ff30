"""The elite: the successes worth most, and the Gaussian that the next trials are drawn from.

It knows scores, not where they come from.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from shearline.learner.base import Array
from shearline.learner.ledger import Trials
from shearline.learner.region import fold

#: Least deviation of a proposal along any axis, in edges of the cube.
DEVIATION_MIN = 1e-6


@dataclass(frozen=True, slots=True)
class Elite:
    """A Gaussian around the best successes.

    Attributes:
        centre: Their weighted mean ``(n,)``.
        factor: Matrix ``(n, n)`` whose product with its transpose is the covariance.
    """

    centre: Array
    factor: Array

    @property
    def deviation(self) -> Array:
        """Standard deviations along the axes ``(n,)``."""
        lengths: Array = np.sqrt(np.sum(self.factor**2, axis=1))
        return lengths

    def at_least(self, deviation: float) -> Elite:
        """Return it, grown in all directions alike until its mean deviation is no less.

        Args:
            deviation: Geometric mean over the axes, in edges of the cube; 0 or more.
        """
        mean = float(np.exp(np.mean(np.log(self.deviation))))
        return replace(self, factor=self.factor * max(1.0, deviation / mean))

    def moved(self, best: Array) -> Elite:
        """Return it around the log-rank weighted mean of tuples ``(count, n)``, best first.

        One step of the cross-entropy method for the middle alone (Rubinstein 1999): the spread
        stays, since it is there to learn from and not to end soon.
        """
        return replace(self, centre=rank_weights(len(best)) @ best)

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return ``(count, n)`` draws, folded back into the cube."""
        normal = rng.standard_normal((count, len(self.centre)))
        return fold(self.centre + normal @ self.factor.T)

    def snapshot(self) -> Mapping[str, object]:
        """Return centre and covariance as plain lists."""
        return {
            "centre": self.centre.tolist(),
            "covariance": (self.factor @ self.factor.T).tolist(),
        }


def elite_size(episode_length: int, n: int, successes: int) -> int:
    """Return how many successes make the elite.

    Half of an episode, but enough to say something about ``n`` spreads. They are chosen by what the
    model expects of them, not by their luck, so that more of them would only be older ones.

    Args:
        episode_length: Trials of an episode.
        n: Number of parameters.
        successes: How many there are.
    """
    return min(max(episode_length // 2, n // 2 + 5), successes)


def rank_weights(count: int) -> Array:
    """Return weights ``(count,)`` that fall with the logarithm of the rank and sum to 1.

    Those of Hansen (2016), The CMA evolution strategy: a tutorial, equation 49.
    """
    raw = np.log(count + 0.5) - np.log(np.arange(1, count + 1))
    result: Array = raw / raw.sum()
    return result


def fit_elite(u: Array, spread: float) -> Elite:
    """Fit the Gaussian to the elite.

    The covariance is shrunk towards its diagonal, the more the fewer samples there are for each
    parameter: ``S = (1 - a) C + a diag(C)`` with ``a = n / (n + count)``.

    Args:
        u: Tuples ``(count, n)``, best first.
        spread: Factor on the deviations.
    """
    count, n = u.shape
    weights = rank_weights(count)
    centre = weights @ u
    offset = u - centre
    raw = (offset.T * weights) @ offset / max(1.0 - float(np.sum(weights**2)), 0.1)
    share = n / (n + count)
    covariance = (1.0 - share) * raw
    covariance[np.diag_indices(n)] = np.maximum(np.diag(raw), DEVIATION_MIN**2)
    return Elite(centre, spread * np.linalg.cholesky(covariance))


def cheapest(trials: Trials, episode_length: int, spread: float) -> Elite:
    """Return an elite of the successes that were cheapest: where to look before there is a model.

    Args:
        trials: At least one succeeded.
        episode_length: Trials of an episode.
        spread: Factor on the deviations.
    """
    won = trials.where(trials.success)
    count = elite_size(episode_length, won.u.shape[1], len(won))
    return fit_elite(won.u[np.argsort(won.cost, kind="stable")[:count]], spread)
