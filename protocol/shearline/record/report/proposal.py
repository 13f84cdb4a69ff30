"""Where a learner draws its next trials from, as its snapshot says: Gaussians, as ellipses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: Standard deviations at which an ellipse is drawn; it holds 86 % of draws in two parameters.
REACH = 2.0
#: Corners of an ellipse.
POINTS = 60


def ellipses(model: Mapping[str, Any], x: int, y: int, n: int) -> Iterator[Array]:
    """Yield one ellipse ``(points, 2)``, shares of the bounds, for each Gaussian of a snapshot.

    Args:
        model: A snapshot with a ``mixture`` or an ``elite``.
        x: Parameter across.
        y: Parameter upwards.
        n: Parameters of the run.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, POINTS + 1)
    circle = np.stack([np.cos(angles), np.sin(angles)])
    for mean, covariance in _gaussians(model):
        if mean.shape != (n,) or covariance.shape != (n, n):
            continue
        part = covariance[np.ix_([x, y], [x, y])]
        lengths, axes = np.linalg.eigh(part)
        shape = axes * np.sqrt(np.maximum(lengths, 0.0))
        yield mean[[x, y]] + REACH * (shape @ circle).T


def _gaussians(model: Mapping[str, Any]) -> Iterator[tuple[Array, Array]]:
    if mixture := model.get("mixture"):
        for mean, covariance in zip(mixture["means"], mixture["covariances"], strict=True):
            yield np.array(mean), np.array(covariance)
    if elite := model.get("elite"):
        yield np.array(elite["centre"]), np.array(elite["covariance"])
