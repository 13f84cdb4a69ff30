"""The update step: the mean reward of the good samples, and who is good against it (section 3.3).

The mean is carried from episode to episode as the *cost* that earns it. Under the linear map
this is the same thing, for the mean of an affine function is the function of the mean; and it
stays right when a new costliest success moves the map.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.ledger import Trials
from shearline.learner.psp.config import Labels, RewardMap

#: Before anything is known every success is good: its reward is 0 or more, the first mean is 0.
UNBOUNDED = math.inf

#: Reward of a failed trial.
FAILED = -1.0


def positives(trials: Trials, threshold_cost: float) -> npt.NDArray[np.bool_]:
    """Return which trials ``(m,)`` succeeded at no more than a cost; equal is good.

    Equality counts so that a single good sample, which is its own mean, stays good.
    """
    # The mean of equal costs can fall below each of them by a rounding error.
    slack = 1e-12 * abs(threshold_cost) if math.isfinite(threshold_cost) else 0.0
    return trials.success & (trials.cost <= threshold_cost + slack)


def mean_cost(cost: Array, reward: RewardMap) -> float:
    """Return the cost that earns the mean reward of costs ``(k,)``, k >= 1.

    Args:
        cost: Costs of good samples.
        reward: The map; the reciprocal one falls back to the linear one unless all costs are
            positive.
    """
    if reward is RewardMap.RECIPROCAL and bool(np.all(cost > 0)):
        return float(1.0 / np.mean(1.0 / cost))
    return float(np.mean(cost))


def update(
    trials: Trials, threshold_cost: float, labels: Labels, reward: RewardMap
) -> tuple[npt.NDArray[np.bool_], float]:
    """Move the threshold over all data and label all samples.

    Args:
        trials: Everything told so far, m trials.
        threshold_cost: Cost of the mean reward of the episode before; ``inf`` at the start.
        labels: Whether samples are labelled before or after the threshold moves.
        reward: The map from cost to reward.

    Returns:
        Labels ``(m,)``, true for good, and the new threshold. Without a good sample the
        threshold stays where it was.
    """
    before = positives(trials, threshold_cost)
    if not before.any():
        return before, threshold_cost
    moved = mean_cost(trials.cost[before], reward)
    return (positives(trials, moved) if labels is Labels.NEW else before), moved


def rewards(trials: Trials, reward: RewardMap) -> Array:
    """Return each trial's reward ``(m,)`` under the present map, for people and pictures.

    Successes lie in [0, 1] under the linear map (1 is the cheapest), failures are -1.
    """
    result = np.full(len(trials), FAILED)
    won = trials.cost[trials.success]
    if not len(won):
        return result
    if reward is RewardMap.RECIPROCAL and bool(np.all(won > 0)):
        result[trials.success] = 1.0 / won
        return result
    span = float(won.max() - won.min())
    result[trials.success] = (won.max() - won) / span if span > 0 else 1.0
    return result
