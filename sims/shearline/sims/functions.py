"""Test problems with a known answer: the paper's benchmark functions and a noisy trap.

All functions take tuples ``(..., n)`` and return ``(...)``. They know no learner, no task and
no protocol.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.protocol.space import Space

Array = npt.NDArray[np.float64]

#: The paper's search space is [-5, 5]^n, its equation (5).
BOUND = 5.0
#: Shifted optima are uniform in [-SHIFT_MAX, SHIFT_MAX]^n, the middle half of the box: off the
#: centre, where a start from the middle of the box would find it for nothing, and far enough
#: from the walls not to reward clipping.
SHIFT_MAX = 2.5


def sphere(x: Array) -> Array:
    """Return the sum of squares, the paper's equation (3); 0 at the origin."""
    result: Array = np.sum(np.square(x), axis=-1)
    return result


def rastrigin(x: Array) -> Array:
    """Return ``A n + sum(x^2 - A cos(2 pi x))`` with A = 10, equation (4); 0 at the origin."""
    result: Array = 10.0 * x.shape[-1] + np.sum(
        np.square(x) - 10.0 * np.cos(2.0 * np.pi * x), axis=-1
    )
    return result


def two_peaks(xy: Array) -> Array:
    """Return the reward of the paper's picture problem, equations (1) and (2).

    Two unit-width bells at (.25, .25) and (.75, .75), as printed. They are so wide that their
    sum has its one maximum, 1.765, half-way between them; see :func:`two_peaks_narrow`.

    Args:
        xy: Points ``(..., 2)`` of the unit square.
    """
    return two_peaks_narrow(xy, width=1.0)


def two_peaks_narrow(xy: Array, width: float = 0.2) -> Array:
    """Return the same with bells ``exp(-(distance / width)^2)``, which do have two peaks.

    Two equal bells part when their centres are more than ``sqrt(2) width`` apart; here they are
    .707 apart, so ``width`` must be below .5 to show what the paper's figure 3 shows.
    """
    first = np.sum(np.square(xy - 0.25), axis=-1)
    second = np.sum(np.square(xy - 0.75), axis=-1)
    result: Array = np.exp(-first / width**2) + np.exp(-second / width**2)
    return result


# -- a cheap, fragile ridge beside a robust basin ------------------------------------------------

#: Parameters of the ridge problem that matter; the others do nothing.
RIDGE_ACTIVE = 6


def ridge_success(u: Array) -> Array:
    """Return the chance that a trial of the ridge problem succeeds.

    Our own problem, after what the paper saw HiREPS do on the real lock (section 5.2): a learner
    that follows the cheapest successes ends where four in ten work. With ``d`` the distance of
    the six active parameters from .35 in units of .3 (root mean square), the basin succeeds with
    ``.99 / (1 + exp(-8 (1.05 - d)))``; where the first parameter is within .05 of .9 the ridge
    takes over with .4.

    Args:
        u: Tuples ``(..., n)`` of the unit cube, n >= 6.
    """
    basin = 0.99 / (1.0 + np.exp(-8.0 * (1.05 - _basin_distance(u))))
    return np.where(_on_ridge(u), 0.4, basin)


def ridge_cost(u: Array) -> Array:
    """Return a success's cost in the ridge problem: .25 on the ridge, .5 and up in the basin."""
    basin = 0.5 + 0.5 * np.square(_basin_distance(u))
    return np.where(_on_ridge(u), 0.25 + 2.0 * np.abs(u[..., 0] - 0.9), basin)


#: What a failed trial of the ridge problem costs.
RIDGE_FAILURE_COST = 10.0


def _basin_distance(u: Array) -> Array:
    offset = (u[..., :RIDGE_ACTIVE] - 0.35) / 0.3
    result: Array = np.sqrt(np.mean(np.square(offset), axis=-1))
    return result


def _on_ridge(u: Array) -> npt.NDArray[np.bool_]:
    on: npt.NDArray[np.bool_] = np.abs(u[..., 0] - 0.9) < 0.05
    return on


# -- the same as problems that a study can run a learner on ---------------------------------------


@dataclass(frozen=True, slots=True)
class Problem:
    """A space and how one trial in it ends.

    Attributes:
        name: For tables.
        space: Where it is defined.
        cost: Cost of tuples ``(..., n)`` in task units.
        success: Chance of success of tuples ``(..., n)``, or ``None`` if nothing ever fails.
        failure_cost: What a failed trial costs.
    """

    name: str
    space: Space
    cost: Callable[[Array], Array]
    success: Callable[[Array], Array] | None = None
    failure_cost: float = 0.0

    def trial(self, theta: Array, rng: np.random.Generator) -> tuple[float, bool]:
        """Return cost and success of one trial of one tuple ``(n,)``."""
        if self.success is not None and rng.random() >= float(self.success(theta)):
            return self.failure_cost, False
        return float(self.cost(theta)), True


def optimum(n: int, seed: int) -> Array:
    """Return a seed's shifted optimum ``(n,)``, uniform in [-SHIFT_MAX, SHIFT_MAX]^n."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, n, 0x5A1F7]))
    return rng.uniform(-SHIFT_MAX, SHIFT_MAX, n)


def shifted(function: Callable[[Array], Array], n: int, seed: int) -> Problem:
    """Return a benchmark function with its optimum moved to :func:`optimum`, on [-5, 5]^n."""
    at = optimum(n, seed)
    name = f"{getattr(function, '__name__', 'function')}, shifted"
    return Problem(name, Space.box(n, -BOUND, BOUND), lambda x: function(x - at))


def centred(function: Callable[[Array], Array], n: int) -> Problem:
    """Return a benchmark function as the paper has it, its optimum in the middle of [-5, 5]^n."""
    name = f"{getattr(function, '__name__', 'function')}, centred"
    return Problem(name, Space.box(n, -BOUND, BOUND), function)


def fragile_ridge(n: int = 23) -> Problem:
    """Return the ridge problem on the unit cube; about half of a latin hypercube succeeds."""
    return Problem("fragile ridge", Space.unit(n), ridge_cost, ridge_success, RIDGE_FAILURE_COST)


def noisy_sphere(n: int, seed: int) -> Problem:
    """Return a bowl on the unit cube whose trials fail the more often the farther out they are.

    With ``d`` the root mean square over the axes of the distance from the seed's optimum in units
    of .3, a trial succeeds with chance ``.97 / (1 + exp(-8 (1 - d)))`` and then costs
    ``.2 + d^2``.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, n, 0x5F0E]))
    at = rng.uniform(0.25, 0.75, n)

    def distance(u: Array) -> Array:
        offset: Array = np.sqrt(np.mean(np.square((u - at) / 0.3), axis=-1))
        return offset

    return Problem(
        f"noisy sphere in {n}",
        Space.unit(n),
        lambda u: 0.2 + np.square(distance(u)),
        lambda u: 0.97 / (1.0 + np.exp(-8.0 * (1.0 - distance(u)))),
        RIDGE_FAILURE_COST,
    )
