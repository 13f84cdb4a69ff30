"""What a learner would use from now on, and how sure it may honestly be of it.

The cheapest success ever seen is a lucky minimum: run again, such tuples succeed about half of
the time. What is recommended is therefore the middle of where the learner has come to stand, and
what is claimed for it rests on trials that were drawn around it, not on the model's opinion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array, Recommendation
from shearline.learner.interval import CONFIDENCE, clopper_pearson_low
from shearline.learner.ledger import Trials
from shearline.learner.region import Region
from shearline.protocol.space import Space

#: Trials that count as drawn from the present policy. 60 of 60 support a claim of .951, 30 of 30
#: one of .905; many more would reach back to episodes that were drawn elsewhere.
ON_POLICY_TRIALS = 60
#: Share of the recent successes, nearest first, that the expected cost rests on.
NEAR_SHARE = 0.75
#: Standard errors that a slope of the cost must exceed to be believed.
SURE = 2.0
#: Sizes of regions that are weighed, in multiples of how far out a recent trial typically lies.
REACHES = (0.5, 1.0, 2.0)
#: Trials farther out than so many reaches say nothing about a region.
NEIGHBOURHOOD = 2.0
#: A larger region is preferred to a better one if its bound is no worse than this share of it.
GIVE = 0.95


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
    """Return what a success in the middle is expected to cost; ``nan`` without any success.

    The costs of the recent successes are fitted by ``a + b d^2``, with ``d`` the distance from
    the middle, over the nearer ``NEAR_SHARE`` of them; ``a`` is what is expected, but no less than
    the cheapest of them. Of ``b`` only that is believed which noise would not show as well: what
    exceeds two of its standard errors. In many dimensions all trials lie about equally far out, and
    a slope made of noise would promise for the middle what none of them had.
    """
    won = recent.where(recent.success)
    if not len(won):
        return math.nan
    square = focus.distance(won.u) ** 2
    near = np.argsort(square, kind="stable")[: max(1, round(NEAR_SHARE * len(won)))]
    x, cost = square[near], won.cost[near]
    offset = x - x.mean()
    variance = float(offset @ offset)
    slope = _sure_slope(offset, cost - cost.mean()) if len(x) > 2 and variance > 0.0 else 0.0
    return max(float(cost.mean()) - slope * float(x.mean()), float(cost.min()))


def _sure_slope(x: Array, y: Array) -> float:
    """Return by how much the slope of ``y`` over ``x (k,)``, both of mean 0, is surely above 0."""
    variance = float(x @ x)
    slope = float(x @ y) / variance
    error = math.sqrt(float(np.sum(np.square(y - slope * x))) / (len(x) - 2) / variance)
    return max(0.0, slope - SURE * error)


def claimed_region(space: Space, recent: Trials, focus: Focus) -> Region | None:
    """Return the largest ellipsoid whose success is about as well supported as that of any.

    A few sizes are weighed, which depend on where the recent trials lie and not on how they
    ended. Each is held to those of them that lie, on average, as far out as draws from it do
    (:func:`_as_far_out`): if success does not rise with the distance from the middle, draws
    succeed at least as often. The Clopper-Pearson bounds hold for all sizes together, with the
    confidence shared out among them (Bonferroni), so that any may be chosen: here the largest
    whose bound is within ``GIVE`` of the best.

    ``None`` below two successes, and where no size has any support.
    """
    if int(recent.success.sum()) < 2:
        return None
    n = len(focus.scale)
    distance = focus.distance(recent.u) / math.sqrt(n)
    reaches = np.multiply(REACHES, np.median(distance))
    held = [recent.success[_as_far_out(distance, reach)] for reach in reaches]
    confidence = 1.0 - (1.0 - CONFIDENCE) / len(REACHES)
    lows = [clopper_pearson_low(int(won.sum()), len(won), confidence) for won in held]
    if reaches[0] == 0.0 or max(lows) == 0.0:
        return None
    best = max(k for k, low in enumerate(lows) if low >= GIVE * max(lows))
    return Region(
        space=space,
        centre=space.denormalise(np.clip(focus.centre, 0.0, 1.0)),
        # Uniform in an ellipsoid of half axes r, a draw has the standard deviations
        # r / sqrt(n + 2) and lies sqrt(n / (n + 2)) of the way out (root mean square).
        radius=reaches[best] * math.sqrt(n + 2) * focus.scale * (space.high - space.low),
        success_low=lows[best],
        confidence=CONFIDENCE,
        trials=len(held[best]),
        successes=int(held[best].sum()),
    )


def _as_far_out(distance: Array, reach: float) -> npt.NDArray[np.int64]:
    """Return which trials ``(k,)`` speak for an ellipsoid that reaches so far.

    Those within ``NEIGHBOURHOOD`` reaches, and of these the outermost whose root mean square
    distance is no less than ``reach``: all, if that holds for all; none, if it holds for none.

    Args:
        distance: Root mean square over the axes of the offset in deviations ``(m,)``.
        reach: In the same unit.
    """
    order = np.argsort(-distance, kind="stable")
    inside = order[distance[order] <= NEIGHBOURHOOD * reach]
    mean_square = np.cumsum(distance[inside] ** 2) / np.arange(1, len(inside) + 1)
    outermost: npt.NDArray[np.int64] = inside[: int(np.sum(mean_square >= reach**2))]
    return outermost
