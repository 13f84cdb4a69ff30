"""What a learner would use from now on, and how sure it may honestly be of it.

The cheapest success ever seen is a lucky minimum: run again, such tuples succeed about half of
the time. What is recommended is therefore the middle of where the learner has come to stand, and
what is claimed for it rests on trials that were drawn around it, not on the model's opinion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shearline.learner.base import Array, Recommendation
from shearline.learner.interval import CONFIDENCE, clopper_pearson_low
from shearline.learner.ledger import Trials
from shearline.learner.region import Region
from shearline.protocol.space import Space

#: Trials that count as drawn from the present policy. 60 of 60 support a claim of .951, 30 of 30
#: one of .905; many more would reach back to episodes that were drawn elsewhere.
ON_POLICY_TRIALS = 60


@dataclass(frozen=True, slots=True)
class Focus:
    """Where a learner stands, in unit coordinates.

    Attributes:
        centre: The tuple ``(n,)`` it would use.
        scale: Standard deviation ``(n,)`` of its proposals around the centre; positive.
    """

    centre: Array
    scale: Array

    def distance(self, u: Array) -> Array:
        """Return the scaled distance of tuples ``(m, n)`` from the centre as ``(m,)``."""
        offset: Array = (u - self.centre) / self.scale
        lengths: Array = np.sqrt(np.sum(offset**2, axis=1))
        return lengths


def elite_focus(trials: Trials, n: int) -> Focus:
    """Return the middle and spread of the cheaper half of the successes.

    The middle of the cube with the spread of a uniform distribution while nothing has succeeded.
    """
    won = trials.where(trials.success)
    if not len(won):
        return Focus(np.full(n, 0.5), np.full(n, math.sqrt(1 / 12)))
    cheap = won.u[np.argsort(won.cost, kind="stable")[: (len(won) + 1) // 2]]
    return Focus(cheap.mean(axis=0), np.maximum(cheap.std(axis=0), 0.01))


def recommendation(space: Space, trials: Trials, focus: Focus) -> Recommendation:
    """State the middle of where the learner stands, and what the trials around it support.

    The interval is ``[low, 1]``: ``low`` is the Clopper-Pearson bound on the latest
    ``ON_POLICY_TRIALS`` trials. It bounds the policy's own success with 95 % confidence, and the
    tuple's as far as the middle of a policy succeeds at least as often as its draws do on
    average. Nothing that was seen bounds the middle from above, hence 1. The probability is an
    estimate only: the share of successes (with half a success and half a failure added) among
    the half of those trials that lie nearest to the middle, never below ``low``.

    Args:
        space: What is being learned.
        trials: All told outcomes.
        focus: Where the learner stands.
    """
    recent = trials.last(ON_POLICY_TRIALS)
    order = np.argsort(focus.distance(recent.u), kind="stable")
    near = recent.success[order[: (len(recent) + 1) // 2]]
    low = clopper_pearson_low(int(recent.success.sum()), len(recent))
    estimate = (float(near.sum()) + 0.5) / (len(near) + 1)
    return Recommendation(
        theta=space.denormalise(np.clip(focus.centre, 0.0, 1.0)),
        success_probability=max(low, estimate),
        interval=(low, 1.0),
        cost=_expected_cost(recent, focus),
        region=claimed_region(space, recent, focus),
    )


def _expected_cost(recent: Trials, focus: Focus) -> float:
    """Return the mean cost of the nearer half of the recent successes; ``nan`` without any."""
    won = recent.where(recent.success)
    if not len(won):
        return math.nan
    order = np.argsort(focus.distance(won.u), kind="stable")
    return float(won.cost[order[: (len(won) + 1) // 2]].mean())


def claimed_region(space: Space, recent: Trials, focus: Focus) -> Region | None:
    """Return the ellipsoid with the spread of the policy, held to the policy's own success.

    Uniform draws from an ellipsoid of half axes ``sqrt(n + 2) scale`` have the standard
    deviations ``scale``. ``None`` below two successes.
    """
    won = int(recent.success.sum())
    if won < 2:
        return None
    reach = math.sqrt(len(focus.scale) + 2)
    return Region(
        space=space,
        centre=space.denormalise(np.clip(focus.centre, 0.0, 1.0)),
        radius=reach * focus.scale * (space.high - space.low),
        success_low=clopper_pearson_low(won, len(recent)),
        confidence=CONFIDENCE,
        trials=len(recent),
        successes=won,
    )
