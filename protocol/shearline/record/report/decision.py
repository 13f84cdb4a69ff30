"""How a learner parts the space, evaluated from its snapshot alone.

A snapshot holds the whole function as plain numbers; the kinds that learners here write are known.
No learner is: what reads a record must not need what wrote it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: Value of tuples ``(m, n)``, shares of the bounds, as ``(m,)``; at least 0 means good.
Decision = Callable[[Array], Array]


def decision_of(model: Mapping[str, Any], n: int) -> Decision | None:
    """Return the partition of a snapshot as a function.

    Args:
        model: A snapshot.
        n: Parameters of the run.

    Returns:
        ``None`` where there is no partition, or none of a known kind for so many parameters.
    """
    said = model.get("partition")
    if not isinstance(said, Mapping):
        return None
    match said.get("kind"):
        case "svm-rbf" if _width(said["support"]) == n:
            return _machine(said)
        case "network" if len(said["hidden"]) == n:
            return _network(said)
        case "log-odds" if len(said["centre"]) == n:
            return _log_odds(said)
        case "trees" if max(said["feature"], default=-1) < n:
            return _trees(said)
    return None


def _machine(said: Mapping[str, Any]) -> Decision:
    """``f(u) = sum_i dual_i exp(-gamma |u - support_i|^2) + intercept``."""
    support, dual = np.array(said["support"]), np.array(said["dual"])
    gamma, intercept = float(said["gamma"]), float(said["intercept"])

    def decide(u: Array) -> Array:
        squares = np.sum(u**2, axis=1)[:, None] + np.sum(support**2, axis=1) - 2.0 * u @ support.T
        values: Array = np.exp(-gamma * np.maximum(squares, 0.0)) @ dual + intercept
        return values

    return decide


def _network(said: Mapping[str, Any]) -> Decision:
    """``f(u) = tanh((2 u - 1) W + b) w + c``."""
    hidden, hidden_offset = np.array(said["hidden"]), np.array(said["hidden_offset"])
    out, offset = np.array(said["out"]), float(said["offset"])

    def decide(u: Array) -> Array:
        values: Array = np.tanh((2.0 * u - 1.0) @ hidden + hidden_offset) @ out + offset
        return values

    return decide


def _log_odds(said: Mapping[str, Any]) -> Decision:
    """``f(u) = w_0 + w_1 mean(z^2 - 1) + sum_j (a_j z_j + b_j (z_j^2 - 1))``: above 0, it succeeds.

    ``z = (u - centre) / scale``; the weights are ``w_0, w_1, a, b``.
    """
    centre, scale = np.array(said["centre"]), np.array(said["scale"])
    weights = np.array(said["weights"])

    def decide(u: Array) -> Array:
        z = (u - centre) / scale
        square = np.square(z) - 1.0
        phi = np.hstack([square.mean(axis=1, keepdims=True), z, square])
        values: Array = phi @ weights[1:] + weights[0]
        return values

    return decide


def _trees(said: Mapping[str, Any]) -> Decision:
    """``f(u) = offset + sum_t value(leaf of tree t that u falls into)``; a leaf's feature is -1."""
    root, feature, left, right = (np.array(said[k]) for k in ("root", "feature", "left", "right"))
    threshold, value, offset = np.array(said["threshold"]), np.array(said["value"]), said["offset"]

    def decide(u: Array) -> Array:
        # They were fitted to single precision: on an edge it decides on which side a tuple falls.
        single, rows = u.astype(np.float32), np.arange(len(u))[:, None]
        node = np.tile(root, (len(u), 1))
        while np.any(feature[node] >= 0):
            goes_left = single[rows, feature[node]] <= threshold[node]
            node = np.where(goes_left, left[node], right[node])
        values: Array = value[node].sum(axis=1) + float(offset)
        return values

    return decide


def _width(rows: list[list[float]]) -> int:
    return len(rows[0]) if rows else 0
