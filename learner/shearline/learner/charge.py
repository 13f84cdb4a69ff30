"""What a failed trial is charged, for learners that only know costs.

The costs of failures mean little as they are told: a trial that broke off early may have cost
least. Here every failure is made dearer than every success.
"""

from __future__ import annotations

import enum

import numpy as np

from shearline.learner.base import Array
from shearline.learner.ledger import Trials


class Failures(enum.StrEnum):
    """Whether failures differ among themselves."""

    ALIKE = "alike"  # all the same, as the paper's reward of -1 (its section 3.1) has it
    ORDERED = "ordered"  # by the cost they were told with: nearly there beats far off


def charged(trials: Trials, failures: Failures = Failures.ALIKE) -> Array:
    """Return what each of m trials costs a learner, ``(m,)``.

    A success costs what was told, C. A failure costs ``2 C_max - C_min`` over all successes,
    which the map of costs to rewards that gives 1 to C_min and 0 to C_max would give -1; where
    all successes cost the same, 1 more than they. Ordered failures spread from there over as
    much again, by their own costs. While nothing has succeeded, ordered failures cost what was
    told, and failures that are alike cost 0.
    """
    won = trials.cost[trials.success]
    lost = trials.cost[~trials.success]
    result = trials.cost.copy()
    if not len(won):
        return result if failures is Failures.ORDERED else np.zeros(len(trials))
    span = float(won.max() - won.min()) or max(1.0, abs(float(won.max())))
    # Dearer than every success also where the span is lost in rounding.
    result[~trials.success] = max(won.max() + span, np.nextafter(won.max(), np.inf))
    if failures is Failures.ORDERED and len(lost):
        reach = float(np.ptp(lost)) or 1.0
        result[~trials.success] += span * (lost - lost.min()) / reach
    return result
