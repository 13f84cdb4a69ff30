"""The filtering policy f as a port: anything that gives tuples a decision value can be one.

The paper's is a support vector machine (section 3.2.2) and its future work a neural network. All
of them are fitted by scikit-learn and evaluated here with numpy, so that a snapshot holds the
whole function and can be drawn by who has only the snapshot. This knows labels and tuples, not
rewards or costs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.errors import LearnerError
from shearline.learner.psp.config import Partitioner, PSPConfig
from shearline.learner.psp.machine import Machine, fit_machine
from shearline.learner.psp.network import Network, fit_network
from shearline.learner.psp.trees import Trees, fit_boosting, fit_forest


class Partition(Protocol):
    """A fitted filter: a value, that draws nothing and does not change."""

    def decision(self, u: Array) -> Array:
        """Return the value of tuples ``(m, n)`` as ``(m,)``; at least 0 means accepted."""
        ...

    def snapshot(self) -> Mapping[str, object]:
        """Return the whole function as plain values; ``kind`` says which it is."""
        ...


def fit_partition(
    u: Array, good: npt.NDArray[np.bool_], config: PSPConfig, seed: int = 0
) -> Partition | None:
    """Fit the filter that a configuration asks for.

    Args:
        u: Samples ``(m, n)`` in unit coordinates.
        good: Their labels ``(m,)``.
        config: Which filter, and its numbers.
        seed: For filters that draw while they are fitted.

    Returns:
        The filter, or ``None`` while all labels are the same.
    """
    if good.all() or not good.any():
        return None
    match config.partition:
        case Partitioner.SVM:
            return fit_machine(u, good, config)
        case Partitioner.FOREST:
            return fit_forest(u, good, seed, balanced=config.balanced)
        case Partitioner.BOOSTING:
            return fit_boosting(u, good, seed, balanced=config.balanced)
        case Partitioner.NETWORK:
            return fit_network(u, good, seed, balanced=config.balanced)


def restored(snapshot: Mapping[str, Any]) -> Partition:
    """Return the filter that a snapshot was taken of.

    Raises:
        LearnerError: If its kind is none of ours.
    """
    for kind in (Machine, Trees, Network):
        if snapshot.get("kind") == kind.kind:
            return kind.restored(snapshot)
    raise LearnerError(
        f"expected a partition of kind {Machine.kind}, {Trees.kind} or {Network.kind},"
        f" got {snapshot.get('kind')!r}"
    )
