"""A partitioner that the paper leaves to future work: a small neural network.

It is fitted by scikit-learn and evaluated here, so that a snapshot holds the whole function. It
knows labels and tuples, not rewards or costs.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.psp.trees import class_weights

#: Width of the one hidden layer. A run has a few hundred samples; wider ones take longer and part
#: no better.
HIDDEN = 32
#: Weight of the squared weights against the mean loss of the samples; without it a few hundred
#: separable samples drive the weights, and the steepness of the decision, without bound.
DECAY = 0.1
#: Steps of the optimiser (L-BFGS) after which the function so far is taken.
STEPS_MAX = 200


@dataclass(frozen=True, slots=True)
class Network:
    """A decision function ``f(u) = tanh((2 u - 1) W + b) w + c``, the log odds of good.

    Attributes:
        hidden: W ``(n, h)``.
        hidden_offset: b ``(h,)``.
        out: w ``(h,)``.
        offset: c.
    """

    kind: ClassVar[str] = "network"

    hidden: Array
    hidden_offset: Array
    out: Array
    offset: float

    def decision(self, u: Array) -> Array:
        """Return ``f`` of tuples ``(m, n)`` as ``(m,)``; at least 0 means accepted."""
        layer: Array = np.tanh(centred(u) @ self.hidden + self.hidden_offset)
        return layer @ self.out + self.offset

    def snapshot(self) -> Mapping[str, object]:
        """Return the function as plain values."""
        return {
            "kind": self.kind,
            "hidden": self.hidden.tolist(),
            "hidden_offset": self.hidden_offset.tolist(),
            "out": self.out.tolist(),
            "offset": self.offset,
        }

    @classmethod
    def restored(cls, snapshot: Mapping[str, Any]) -> Self:
        """Return the function of a snapshot."""
        return cls(
            hidden=np.array(snapshot["hidden"], dtype=np.float64),
            hidden_offset=np.array(snapshot["hidden_offset"], dtype=np.float64),
            out=np.array(snapshot["out"], dtype=np.float64),
            offset=float(snapshot["offset"]),
        )


def centred(u: Array) -> Array:
    """Return tuples of the unit cube as the network sees them, in [-1, 1]."""
    return 2.0 * u - 1.0


def fit_network(u: Array, good: npt.NDArray[np.bool_], seed: int, *, balanced: bool) -> Network:
    """Fit a network of one hidden layer.

    Args:
        u: Samples ``(m, n)``.
        good: Their labels ``(m,)``, of both kinds.
        seed: For the weights that it starts from.
        balanced: Whether both classes weigh the same.
    """
    from sklearn.exceptions import ConvergenceWarning  # noqa: PLC0415 - heavy, at the first fit
    from sklearn.neural_network import MLPClassifier  # noqa: PLC0415

    network = MLPClassifier(
        hidden_layer_sizes=(HIDDEN,),
        activation="tanh",
        solver="lbfgs",
        alpha=DECAY,
        max_iter=STEPS_MAX,
        random_state=seed,
    )
    with warnings.catch_warnings():
        # A network stopped early still parts the space; that is what the bound is for.
        warnings.simplefilter("ignore", ConvergenceWarning)
        network.fit(centred(u), good, sample_weight=class_weights(good) if balanced else None)
    (hidden, out), (hidden_offset, offset) = network.coefs_, network.intercepts_
    return Network(np.array(hidden), np.array(hidden_offset), out[:, 0].copy(), float(offset[0]))
