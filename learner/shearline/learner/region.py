"""The region: the tuples around a recommendation that a learner vouches for as a whole.

An axis-parallel ellipsoid in task units, so that a person can read off by how much each
parameter may vary. It knows no trials and no learner; what it claims was found out elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shearline.protocol.space import Array, Space


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """An ellipsoid of tuples and what may be expected of a draw from it.

    Attributes:
        space: Names, units and bounds; the region ends where the space does.
        centre: Its middle ``(n,)`` in task units, within bounds.
        radius: Its half axes ``(n,)`` in task units, positive; they may reach beyond the bounds.
        success_low: Lower bound, 0 to 1, of the chance that one fresh trial of one fresh draw
            (see :meth:`sample`) succeeds.
        confidence: Of that bound, e.g. .95.
        trials: Trials that the bound rests on.
        successes: How many of them succeeded.
    """

    space: Space
    centre: Array
    radius: Array
    success_low: float
    confidence: float
    trials: int
    successes: int

    def distance(self, theta: Array) -> Array:
        """Return how far out tuples ``(..., n)`` lie: ``(...)``, 0 the centre, 1 the surface."""
        result: Array = np.sqrt(np.sum(np.square((theta - self.centre) / self.radius), axis=-1))
        return result

    def contains(self, theta: Array) -> bool:
        """Tell whether a tuple ``(n,)`` in task units lies inside, and within the bounds."""
        return self.space.contains(theta) and bool(self.distance(theta) <= 1.0)

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Return ``count`` draws ``(count, n)`` in task units, all inside.

        Uniform in the ellipsoid; what falls beyond a bound is folded back at it, which only ever
        brings it nearer to the centre.
        """
        n = len(self.space)
        direction = rng.standard_normal((count, n))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        reach = rng.random((count, 1)) ** (1.0 / n)
        theta: Array = self.centre + direction * reach * self.radius
        return self.space.denormalise(fold(self.space.normalise(theta)))


def fold(u: Array) -> Array:
    """Fold tuples of any size back into the unit cube, as by mirrors on its walls."""
    folded = np.mod(u, 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)
