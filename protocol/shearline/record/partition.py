"""How a learner parts the space, evaluated from its snapshot alone.

Which samples it rests on, which parameters tell, and what a slice through it shows. The kinds of
filter are known elsewhere; no learner is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from shearline.record.report.decision import decision_of

Array = npt.NDArray[np.float64]

#: Points along each side of a slice: finer than a screen's patience, coarser than its pixels.
SIDE = 72
STEPS = (np.arange(SIDE) + 0.5) / SIDE


@dataclass(frozen=True, slots=True)
class Samples:
    """What a model rests on.

    Attributes:
        u: Tuples ``(m, n)`` in unit coordinates.
        good: Which count as good ``(m,)``.
    """

    u: Array
    good: npt.NDArray[np.bool_]


def samples_of(model: Mapping[str, Any]) -> Samples | None:
    """Return the samples of a snapshot, or ``None`` if it has none."""
    found = model.get("samples")
    if not isinstance(found, Mapping) or not found.get("u"):
        return None
    u = np.asarray(found["u"], dtype=np.float64)
    good = np.asarray(found.get("good", np.zeros(len(u))), dtype=np.bool_)
    return Samples(u, good) if u.ndim == 2 and good.shape == (len(u),) else None


def decision(model: Mapping[str, Any], at: Array, x: int, y: int) -> Array | None:
    """Return the filter's values on one slice, at least 0 where it accepts.

    Along a slice only two coordinates change, and a support vector machine's kernel
    ``exp(-gamma |u - s|^2)`` is the product of its coordinates' shares: its slice costs two small
    products instead of a kernel between all points and all supports.

    Args:
        model: A snapshot.
        at: Tuple ``(n,)`` that the slice goes through.
        x: Parameter along the columns, from low to high.
        y: Parameter along the rows, from high to low, as a picture has them.

    Returns:
        ``(SIDE, SIDE)``; ``None`` while there is no filter, or where its kind is not known here.
    """
    decide = decision_of(model, len(at))
    if decide is None:
        return None
    if model["partition"]["kind"] == "svm-rbf":
        return _separable(model["partition"], at, x, y)
    return decide(plane(at, x, y)).reshape(SIDE, SIDE)


def plane(at: Array, x: int, y: int) -> Array:
    """Return the tuples ``(SIDE * SIDE, n)`` of a slice, rows from high ``y`` to low."""
    u = np.tile(at, (SIDE * SIDE, 1))
    u[:, x] = np.tile(STEPS, SIDE)
    u[:, y] = np.repeat(STEPS[::-1], SIDE)
    return u


def middle(model: Mapping[str, Any], samples: Samples) -> Array:
    """Return the tuple ``(n,)`` that slices go through: the middle of what is good.

    Of the good samples (of all, where none is good) the one that the filter accepts most, so that
    a slice shows what is accepted if anything is; without a filter their median.
    """
    chosen = samples.u[samples.good] if samples.good.any() else samples.u
    decide = decision_of(model, chosen.shape[1])
    if decide is not None:
        return np.array(chosen[int(np.argmax(decide(chosen)))])
    median: Array = np.median(chosen, axis=0)
    return median


def _separable(part: Mapping[str, Any], at: Array, x: int, y: int) -> Array:
    support, gamma = np.array(part["support"], dtype=np.float64), float(part["gamma"])
    rest = np.delete(support - at, [x, y], axis=1)
    weight = np.array(part["dual"]) * np.exp(-gamma * np.sum(rest**2, axis=1))
    along_x = np.exp(-gamma * (STEPS[:, None] - support[:, x]) ** 2)
    along_y = np.exp(-gamma * (STEPS[::-1, None] - support[:, y]) ** 2)
    values: Array = (along_y * weight) @ along_x.T + float(part["intercept"])
    return values


def telling(u: Array, success: Sequence[bool] | npt.NDArray[np.bool_]) -> list[int]:
    """Return the parameters in order of how far apart they keep successes and failures.

    The distance is that of Kolmogorov and Smirnov between the two empirical distributions; where
    one kind is missing, parameters stay in their own order.

    Args:
        u: Tuples ``(m, n)``.
        success: Their outcomes ``(m,)``.
    """
    won = np.asarray(success, dtype=np.bool_)
    n_parameters = u.shape[1]
    if won.all() or not won.any():
        return list(range(n_parameters))
    distances = [_distance(u[won, j], u[~won, j]) for j in range(n_parameters)]
    return sorted(range(n_parameters), key=lambda j: -distances[j])


def _distance(a: Array, b: Array) -> float:
    both = np.concatenate([a, b])
    share_a = np.searchsorted(np.sort(a), both, side="right") / len(a)
    share_b = np.searchsorted(np.sort(b), both, side="right") / len(b)
    return float(np.max(np.abs(share_a - share_b)))
