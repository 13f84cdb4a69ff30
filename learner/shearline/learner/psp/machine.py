"""The paper's partitioner: a support vector machine with an RBF kernel (section 3.2.2).

It is fitted by scikit-learn and evaluated here, so that a decision needs nothing but numpy and a
snapshot holds the whole function. It knows labels and tuples, not rewards or costs.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.psp.config import Distance, PSPConfig

#: Iterations after which libsvm gives the best function found so far. Separable problems of a
#: run's size need a few thousand; high C on contradictory labels would take minutes.
ITERATIONS_MAX = 100_000


@dataclass(frozen=True, slots=True)
class Machine:
    """A decision function ``f(u) = sum_i dual_i exp(-gamma |u - support_i|^2) + intercept``.

    Attributes:
        support: Support vectors ``(s, n)`` in unit coordinates.
        dual: Their signed weights ``(s,)``.
        gamma: Kernel width.
        intercept: Constant term.
        distance: The minimum distance over all samples that won the choice of gamma.
    """

    kind: ClassVar[str] = "svm-rbf"

    support: Array
    dual: Array
    gamma: float
    intercept: float
    distance: float

    def decision(self, u: Array) -> Array:
        """Return ``f`` of tuples ``(m, n)`` as ``(m,)``; at least 0 means accepted."""
        return kernel(u, self.support, self.gamma) @ self.dual + self.intercept

    def norm(self) -> float:
        """Return ``|w|``, the length of the plane's normal in feature space."""
        gram = kernel(self.support, self.support, self.gamma)
        return math.sqrt(max(float(self.dual @ gram @ self.dual), 0.0))

    def snapshot(self) -> Mapping[str, object]:
        """Return the function as plain values."""
        return {
            "kind": self.kind,
            "support": self.support.tolist(),
            "dual": self.dual.tolist(),
            "gamma": self.gamma,
            "intercept": self.intercept,
        }

    @classmethod
    def restored(cls, snapshot: Mapping[str, Any]) -> Self:
        """Return the function of a snapshot."""
        return cls(
            support=np.array(snapshot["support"], dtype=np.float64),
            dual=np.array(snapshot["dual"], dtype=np.float64),
            gamma=float(snapshot["gamma"]),
            intercept=float(snapshot["intercept"]),
            distance=0.0,
        )


def kernel(a: Array, b: Array, gamma: float) -> Array:
    """Return the RBF kernel ``exp(-gamma |a_i - b_j|^2)`` of ``(m, n)`` and ``(s, n)``."""
    squares = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1)[None, :] - 2.0 * (a @ b.T)
    result: Array = np.exp(-gamma * np.maximum(squares, 0.0))
    return result


def fit_machine(u: Array, good: npt.NDArray[np.bool_], config: PSPConfig) -> Machine:
    """Fit one machine per gamma and keep the one whose nearest sample lies farthest away.

    Of gammas that tie, the smallest, i.e. the smoothest function, wins.

    Args:
        u: Samples ``(m, n)`` in unit coordinates.
        good: Their labels ``(m,)``, of both kinds.
        config: C, the gammas and the distance that decides.
    """
    scale = 12.0 / u.shape[1]
    smooth, *others = [_fit_one(u, good, g * scale, config) for g in sorted(config.gammas)]
    best = smooth
    for candidate in others:
        if candidate.distance > best.distance * (1 + 1e-3):
            best = candidate
    return best


def _fit_one(u: Array, good: npt.NDArray[np.bool_], gamma: float, config: PSPConfig) -> Machine:
    from sklearn.exceptions import ConvergenceWarning  # noqa: PLC0415 - heavy, at the first fit
    from sklearn.svm import SVC  # noqa: PLC0415

    machine = SVC(
        C=config.svm_c,
        gamma=gamma,
        class_weight="balanced" if config.balanced else None,
        max_iter=ITERATIONS_MAX,
        cache_size=200,
        random_state=0,  # it draws nothing, but would touch numpy's global generator
    )
    with warnings.catch_warnings():
        # A machine stopped early still parts the space; that is what the bound is for.
        warnings.simplefilter("ignore", ConvergenceWarning)
        machine.fit(u, good)
    parted = Machine(
        support=np.array(machine.support_vectors_),
        dual=np.array(machine.dual_coef_[0]),
        gamma=gamma,
        intercept=float(machine.intercept_[0]),
        distance=0.0,
    )
    distance = float(np.min(np.abs(parted.decision(u))))
    if config.distance is Distance.GEOMETRIC:
        distance /= max(parted.norm(), 1e-300)
    return Machine(parted.support, parted.dual, gamma, parted.intercept, distance)
