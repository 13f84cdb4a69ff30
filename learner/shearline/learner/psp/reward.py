"""The update step (section 3.3): what a sample is worth, their mean, and who is good.

All of it is kept in units of cost. The paper's reward is ``r = (C_max - C) / (C_max - C_min)``
for a success and -1 for a failure; its mean over good samples is earned by the mean of their
costs, and stays right when a new costliest success moves the map.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.ledger import Trials
from shearline.learner.psp.config import Labels, RewardMap

#: Before anything is known every success is good: its reward is 0 or more, the first mean is 0.
UNBOUNDED = math.inf
#: Reward of a failed trial.
FAILED = -1.0
#: Imagined neighbours that succeed as often as all trials do; two of them keep a success whose
#: few neighbours all succeeded from passing for certain.
PRIOR_NEIGHBOURS = 2.0
#: Rows of the distance table held at a time.
ROWS = 512


def positives(trials: Trials, threshold_cost: float) -> npt.NDArray[np.bool_]:
    """Return which trials ``(m,)`` succeeded at no more than a cost; equal is good.

    Equality counts so that a single good sample, which is its own mean, stays good.
    """
    return trials.success & (trials.cost <= threshold_cost)


def _has_inverses(cost: Array) -> bool:
    """Tell whether every cost is positive and its reciprocal still a number."""
    return bool(np.all(cost >= np.finfo(np.float64).tiny * 4.0))


def mean_cost(cost: Array, reward: RewardMap) -> float:
    """Return the cost that earns the mean reward of costs ``(k,)``, k >= 1.

    Args:
        cost: Costs of good samples.
        reward: The map; the reciprocal one falls back to the linear one unless all costs are
            positive.
    """
    if reward is RewardMap.RECIPROCAL and _has_inverses(cost):
        mean = float(1.0 / np.mean(1.0 / cost))
    else:
        mean = float(np.mean(cost))
    # A mean of equal costs can fall below each of them by a rounding error.
    return max(mean, float(np.min(cost)))


def update(
    trials: Trials, threshold_cost: float, labels: Labels, reward: RewardMap
) -> tuple[npt.NDArray[np.bool_], float]:
    """Move the threshold over all data and label all samples.

    Args:
        trials: m trials.
        threshold_cost: Cost of the mean reward of the episode before; ``inf`` at the start.
        labels: Whether samples are labelled before or after the threshold moves.
        reward: The map from cost to reward.

    Returns:
        Labels ``(m,)``, true for good, and the new threshold. Where no success meets the old
        threshold any more (expected costs may rise), it starts over from all successes.
    """
    before = positives(trials, threshold_cost)
    if not before.any():
        before = trials.success
    if not before.any():
        return before, threshold_cost
    moved = mean_cost(trials.cost[before], reward)
    return (positives(trials, moved) if labels is Labels.NEW else before), moved


def expected(trials: Trials, scale: Array, neighbours: int) -> Trials:
    """Charge each success with the failures around it.

    The reward to be expected of a success that its neighbours repeat with chance ``p`` is
    ``p r - (1 - p)``; in cost, ``p C + (1 - p) (2 C_max - C_min)``.

    Args:
        trials: m trials.
        scale: Length ``(n,)`` that counts as one step along each axis.
        neighbours: How many of the nearest other trials estimate ``p``; 0 changes nothing.

    Returns:
        The trials with the expected cost in place of the raw one; failures keep theirs.
    """
    if neighbours == 0 or not trials.success.any():
        return trials
    won = trials.cost[trials.success]
    failure_cost = 2.0 * float(won.max()) - float(won.min())
    p = neighbour_success(trials, scale, neighbours)[trials.success]
    cost = trials.cost.copy()
    cost[trials.success] = p * won + (1.0 - p) * failure_cost
    return replace(trials, cost=cost)


def neighbour_success(trials: Trials, scale: Array, neighbours: int) -> Array:
    """Return each trial's chance ``(m,)`` of success, judged by the trials next to it.

    The trial itself does not count; ``PRIOR_NEIGHBOURS`` at the overall rate do.
    """
    x = trials.u / scale
    squares = np.sum(x**2, axis=1)
    count = min(neighbours, len(trials) - 1)
    wins = np.zeros(len(trials))
    for start in range(0, len(trials), ROWS):
        rows = np.arange(start, min(start + ROWS, len(trials)))
        table = squares[rows, None] + squares[None, :] - 2.0 * (x[rows] @ x.T)
        table[np.arange(len(rows)), rows] = np.inf
        # Stable, so that ties (duplicate tuples) are settled by trial number on every machine.
        near = np.argsort(table, axis=1, kind="stable")[:, :count]
        wins[rows] = trials.success[near].sum(axis=1)
    prior = PRIOR_NEIGHBOURS * float(trials.success.mean())
    result: Array = (wins + prior) / (count + PRIOR_NEIGHBOURS)
    return result


def rewards(trials: Trials, reward: RewardMap) -> Array:
    """Return each trial's reward ``(m,)`` under the present map, for people and pictures.

    Successes lie in [0, 1] under the linear map (1 is the cheapest), failures are -1.
    """
    result = np.full(len(trials), FAILED)
    won = trials.cost[trials.success]
    if not len(won):
        return result
    if reward is RewardMap.RECIPROCAL and _has_inverses(won):
        result[trials.success] = 1.0 / won
        return result
    span = float(won.max() - won.min())
    result[trials.success] = (won.max() - won) / span if span > 0 else 1.0
    return result
