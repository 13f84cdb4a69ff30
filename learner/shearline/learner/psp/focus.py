"""Which of the mixture's components PSP would stay with if it had to choose one tuple now."""

from __future__ import annotations

import math

import numpy as np

from shearline.learner.interval import clopper_pearson_low
from shearline.learner.ledger import Trials
from shearline.learner.psp.proposal import Mixture
from shearline.learner.recommend import ON_POLICY_TRIALS, Focus

#: Successes from which their own middle is better known than the component's.
HELD_MIN = 5
#: Least spread of a focus in units of the cube's edge.
SCALE_MIN = 0.01


def component_focus(mixture: Mixture, trials: Trials) -> Focus:
    """Return the component whose latest trials promise the least cost, judged pessimistically.

    A component answers for the recent trials that lie in it. It is judged by the cost to be
    expected at the *lower bound* of its success probability, so that neither one lucky trial nor
    a cheap fragile corner wins against a component that was tried often and held. What is
    returned is the middle of the successes that it had: the mean of the component itself rests
    on the few cheapest samples, and is a guess at where nothing may have been tried yet.

    Args:
        mixture: The proposal policy.
        trials: Everything told, with raw costs.
    """
    recent = trials.last(ON_POLICY_TRIALS)
    owner = mixture.nearest(recent.u)
    won = recent.cost[recent.success]
    failure_cost = 2.0 * float(won.max()) - float(won.min()) if len(won) else math.inf
    promises = [
        _promise(recent.where(owner == k), failure_cost) for k in range(len(mixture.weights))
    ]
    best = int(np.argmin(promises))
    held = recent.u[recent.success & (owner == best)]
    if len(held) < HELD_MIN:
        return Focus(mixture.means[best], mixture.deviations[best])
    return Focus(held.mean(axis=0), np.maximum(held.std(axis=0), SCALE_MIN))


def _promise(trials: Trials, failure_cost: float) -> float:
    """Return the expected cost of one trial at the lower bound of the success probability."""
    wins = int(trials.success.sum())
    if wins == 0:
        return math.inf
    low = clopper_pearson_low(wins, len(trials))
    return low * float(trials.cost[trials.success].mean()) + (1.0 - low) * failure_cost
