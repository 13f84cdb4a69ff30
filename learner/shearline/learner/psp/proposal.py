"""The proposal policy p: uniform at first, then a Gaussian mixture (section 3.2.1).

It is fitted by scikit-learn and drawn from here, so that draws come from the learner's own
generator. It knows tuples, not rewards, labels or the filter.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.psp.config import Covariance, Outside, PSPConfig

#: Redraws of one tuple that fell outside of the cube before it is clipped after all.
OUTSIDE_REDRAWS_MAX = 20


@dataclass(frozen=True, slots=True)
class Mixture:
    """A mixture of k Gaussians in unit coordinates.

    Attributes:
        weights: Chance of each component ``(k,)``, sums to 1.
        means: Their means ``(k, n)``.
        factors: Matrices ``(k, n, n)`` whose product with their transpose is the covariance.
    """

    weights: Array
    means: Array
    factors: Array

    @property
    def covariances(self) -> Array:
        """Covariances ``(k, n, n)``."""
        product: Array = self.factors @ self.factors.transpose(0, 2, 1)
        return product

    @property
    def deviations(self) -> Array:
        """Standard deviations along the axes ``(k, n)``."""
        lengths: Array = np.sqrt(np.sum(self.factors**2, axis=2))
        return lengths

    @property
    def spread(self) -> Array:
        """Root mean square over the components of the standard deviations ``(n,)``."""
        mean_square: Array = self.weights @ self.deviations**2
        return np.sqrt(mean_square)

    def nearest(self, u: Array) -> npt.NDArray[np.int64]:
        """Return for tuples ``(m, n)`` the component ``(m,)`` most likely to have made each.

        Components are taken as axis-parallel here: this is for telling them apart, not for
        densities.
        """
        offset = (u[:, None, :] - self.means) / self.deviations
        log_density = -0.5 * np.sum(offset**2, axis=2) - np.sum(np.log(self.deviations), axis=1)
        best: npt.NDArray[np.int64] = np.argmax(log_density + np.log(self.weights), axis=1)
        return best

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return ``(count, n)`` draws, not confined to the cube."""
        component = rng.choice(len(self.weights), size=count, p=self.weights)
        normal = rng.standard_normal((count, self.means.shape[1]))
        offset: Array = np.einsum("mij,mj->mi", self.factors[component], normal)
        return self.means[component] + offset

    def snapshot(self) -> Mapping[str, object]:
        """Return weights, means and covariances as plain lists."""
        return {
            "weights": self.weights.tolist(),
            "means": self.means.tolist(),
            "covariances": self.covariances.tolist(),
        }


def draw_inside(mixture: Mixture, rng: np.random.Generator, count: int, outside: Outside) -> Array:
    """Return ``(count, n)`` draws in the cube."""
    u = mixture.draw(rng, count)
    if outside is Outside.REFLECT:
        return reflect(u)
    if outside is Outside.REDRAW:
        for _ in range(OUTSIDE_REDRAWS_MAX):
            beyond = np.any((u < 0.0) | (u > 1.0), axis=1)
            if not beyond.any():
                break
            u[beyond] = mixture.draw(rng, int(beyond.sum()))
    return np.clip(u, 0.0, 1.0)


def reflect(u: Array) -> Array:
    """Fold tuples of any size back into the cube, as by mirrors on its walls."""
    folded = np.mod(u, 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)


def fit_mixture(
    u: Array, components: int | None, seed: int, config: PSPConfig
) -> tuple[Mixture, int]:
    """Fit a mixture to samples.

    Args:
        u: Samples ``(m, n)`` in unit coordinates, m >= 1.
        components: Number of components, or ``None`` to choose it by the Bayesian information
            criterion among 1 to ``config.components_max``. Never more than there are distinct
            samples.
        seed: For the fit's own start.
        config: Shape, floor and spread of the components.

    Returns:
        The mixture, and the number of components that was asked for or chosen.
    """
    distinct = len(np.unique(u, axis=0))
    if distinct < 2:
        return _single(u, config), components or 1
    counts = range(1, config.components_max + 1) if components is None else (components,)
    fits = [_fit_one(u, min(count, distinct), seed, config) for count in counts]
    best = min(fits, key=lambda fit: float(fit.bic(u))) if len(fits) > 1 else fits[0]
    return _mixture(best, config), components or int(best.n_components)


def _fit_one(u: Array, components: int, seed: int, config: PSPConfig) -> Any:
    from sklearn.exceptions import ConvergenceWarning  # noqa: PLC0415 - heavy, at the first fit
    from sklearn.mixture import GaussianMixture  # noqa: PLC0415

    model = GaussianMixture(
        n_components=components,
        covariance_type="diag" if config.covariance is Covariance.DIAGONAL else "full",
        reg_covar=config.covariance_floor**2,
        random_state=seed,
    )
    with warnings.catch_warnings():
        # Expectation maximisation that has not settled still gives a distribution to draw from.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return model.fit(u)


def _mixture(fit: Any, config: PSPConfig) -> Mixture:
    if config.covariance is Covariance.DIAGONAL:
        factors = np.array([np.diag(np.sqrt(v)) for v in fit.covariances_])
    else:
        factors = np.linalg.cholesky(fit.covariances_)
    weights = np.array(fit.weights_)
    return Mixture(weights / weights.sum(), np.array(fit.means_), factors * config.spread)


def _single(u: Array, config: PSPConfig) -> Mixture:
    """Return one component around one tuple, as wide as the floor."""
    factor = np.eye(u.shape[1]) * config.covariance_floor * config.spread
    return Mixture(np.ones(1), u[:1].copy(), factor[None])
