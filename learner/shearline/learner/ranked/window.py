"""Which trials a fit looks at, so that its time and memory stay bounded."""

from __future__ import annotations

import numpy as np

from shearline.learner.base import Array
from shearline.learner.ledger import Trials


def window(trials: Trials, centre: Array, scale: Array, count: int) -> Trials:
    """Return at most ``count`` trials, still in order: the latest half and the nearest half.

    The nearest say what is known where the learner stands, the latest what it lately tried.

    Args:
        trials: Everything told.
        centre: Where the learner stands ``(n,)``, in unit coordinates.
        scale: Length of one step along each axis ``(n,)``.
        count: At least 2.
    """
    if len(trials) <= count:
        return trials
    keep = np.zeros(len(trials), dtype=np.bool_)
    keep[len(trials) - count // 2 :] = True
    distance = np.sum(np.square((trials.u - centre) / scale), axis=1)
    distance[keep] = np.inf
    keep[np.argsort(distance, kind="stable")[: count - count // 2]] = True
    return trials.where(keep)
