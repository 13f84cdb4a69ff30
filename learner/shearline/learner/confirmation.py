"""The confirmation: fresh trials of what was recommended, and how far they bear the claim out.

The learner's own claim rests on trials that it chose, and learned from. These are others, drawn
when it had its last word and never told to it. It knows counts and tuples, not who ran them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shearline.learner.base import Array, Recommendation
from shearline.learner.interval import wilson
from shearline.protocol.messages import Purpose

#: Parts the draws from the region from all others that the run's seed decides.
_REGION_KEY = 0x5EC1


def tuples(recommendation: Recommendation, purpose: Purpose, count: int, seed: int) -> list[Array]:
    """Return what is to be tried: ``count`` tuples ``(n,)`` in task units.

    Args:
        recommendation: What is to be confirmed.
        purpose: ``CONFIRMATION`` for its tuple, ``REGION`` for draws from its region; where no
            region could be stated there is nothing to draw from.
        count: How many, 1 or more.
        seed: The run's; decides the draws.
    """
    if purpose is Purpose.CONFIRMATION:
        return [recommendation.theta] * count
    if recommendation.region is None:
        return []
    rng = np.random.default_rng(np.random.SeedSequence([seed, _REGION_KEY]))
    return list(recommendation.region.sample(rng, count))


@dataclass(frozen=True, slots=True)
class Confirmation:
    """What fresh trials say about a claim.

    Attributes:
        claimed: Lower bound of the success probability that was claimed.
        trials: Fresh trials with an outcome.
        successes: How many of them succeeded.
        lost: Fresh trials without an outcome.
        mean_cost: Mean cost of the successes; ``None`` without any.
    """

    claimed: float
    trials: int
    successes: int
    lost: int
    mean_cost: float | None

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson interval, 95 %, of the success probability; ``(0, 1)`` without trials."""
        return wilson(self.successes, self.trials)

    @property
    def bears_out(self) -> bool:
        """Whether the claim is compatible with what was seen: it does not exceed the interval."""
        return self.claimed <= self.interval[1]
