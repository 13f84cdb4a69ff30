"""Noisy problems with a robust basin and, beside it, a cheap ridge that rarely holds.

Our own, after what the paper saw HiREPS do on the real lock (section 5.2): a learner that
follows the cheapest successes ends where about half of them work. All live in the unit cube and
depend on a few directions of it only. They know no learner and no task.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from shearline.protocol.space import Space
from shearline.sims.functions import Problem

Array = npt.NDArray[np.float64]

#: Parameters, as many as the key-in-lock has.
N = 23
#: What a failed trial costs.
FAILURE_COST = 10.0


@dataclass(frozen=True, slots=True)
class Ridge:
    """A basin of success and a cheap strip across the cube.

    With ``t`` the coordinates of a tuple along ``axes``, seen from the middle of the cube, and
    ``d`` the root mean square of ``(t - centre) / width``, the basin succeeds with
    ``reliable / (1 + exp(-steep (1 - d)))`` and costs ``.5 + .5 d^2`` (at most 2.5). Where the
    first coordinate is within ``strip_width`` of ``strip_at``, a trial costs about half of the
    basin's best and succeeds with ``strip_chance`` of what it would at ``d = 0``.

    Attributes:
        axes: Orthonormal rows ``(k, n)``.
        centre: Middle of the basin ``(k,)`` along them.
        width: Its half width, in edges of the cube.
        steep: How sharply success ends at its rim.
        reliable: Chance of success far inside the rim.
        strip_at: Where the strip is, along the first axis.
        strip_width: Its half width.
        strip_chance: Chance of success on it, where the other coordinates are within the rim.
        strip_everywhere: Whether the strip forgives what the other coordinates do.
    """

    axes: Array
    centre: Array
    width: float
    steep: float = 12.0
    reliable: float = 1.0
    strip_at: float = 0.4
    strip_width: float = 0.05
    strip_chance: float = 0.45
    strip_everywhere: bool = True

    def success(self, u: Array) -> Array:
        """Return the chance ``(...)`` that a trial of tuples ``(..., n)`` succeeds."""
        t = self._coordinates(u)
        basin = self.reliable * _rim(self._distance(t, 0), self.steep)
        strip = np.full(basin.shape, self.strip_chance)
        if not self.strip_everywhere:
            strip = strip * _rim(self._distance(t, 1), self.steep)
        return np.where(self._on_strip(t), strip, basin)

    def cost(self, u: Array) -> Array:
        """Return what a success of tuples ``(..., n)`` costs, ``(...)``."""
        t = self._coordinates(u)
        basin = 0.5 + 0.5 * np.minimum(np.square(self._distance(t, 0)), 4.0)
        strip = 0.2 + 2.0 * np.abs(t[..., 0] - self.strip_at)
        return np.where(self._on_strip(t), strip, basin)

    def _coordinates(self, u: Array) -> Array:
        coordinates: Array = (u - 0.5) @ self.axes.T
        return coordinates

    def _distance(self, t: Array, first: int) -> Array:
        offset = (t[..., first:] - self.centre[first:]) / self.width
        result: Array = np.sqrt(np.mean(np.square(offset), axis=-1))
        return result

    def _on_strip(self, t: Array) -> npt.NDArray[np.bool_]:
        on: npt.NDArray[np.bool_] = np.abs(t[..., 0] - self.strip_at) < self.strip_width
        return on


def _rim(distance: Array, steep: float) -> Array:
    """Return ``1 / (1 + exp(-steep (1 - d)))``."""
    result: Array = 1.0 / (1.0 + np.exp(-steep * (1.0 - distance)))
    return result


def _axes(rng: np.random.Generator, n: int, active: int, *, rotated: bool) -> Array:
    """Return ``active`` of the cube's axes, or as many random orthonormal directions."""
    if not rotated:
        return np.eye(n)[rng.permutation(n)[:active]]
    basis: Array = np.linalg.qr(rng.standard_normal((n, n)))[0]
    return np.array(basis[:, :active].T)


def straight(seed: int, n: int = N) -> Ridge:
    """Return a ridge along the cube: about half of it succeeds."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, n, 1]))
    centre = rng.uniform(-0.2, 0.0, 8)
    axes = _axes(rng, n, 8, rotated=False)
    return Ridge(axes, centre, width=0.32, steep=7.0, strip_at=0.35)


def rotated(seed: int, n: int = N) -> Ridge:
    """Return a ridge across the cube: every parameter matters a little."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, n, 2]))
    centre = rng.uniform(-0.25, 0.1, 8)
    axes = _axes(rng, n, 8, rotated=True)
    return Ridge(axes, centre, width=0.3, steep=7.0, strip_at=0.42, strip_width=0.1)


def sparse(seed: int, n: int = N) -> Ridge:
    """Return a ridge of which only about 5 % of the cube succeeds."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, n, 3]))
    centre = rng.uniform(-0.2, 0.0, 8)
    axes = _axes(rng, n, 8, rotated=False)
    return Ridge(axes, centre, width=0.195, strip_at=0.3, strip_everywhere=False)


#: Names of the three kinds.
KINDS: Mapping[str, Callable[[int], Ridge]] = MappingProxyType(
    {"straight": straight, "rotated": rotated, "sparse": sparse}
)


def by_name(kind: str, seed: int) -> Problem:
    """Return one seed's problem of a kind; the seed decides where basin and ridge lie."""
    ridge = KINDS[kind](seed)
    name = f"{kind} ridge"
    return Problem(name, Space.unit(N), ridge.cost, ridge.success, FAILURE_COST)
