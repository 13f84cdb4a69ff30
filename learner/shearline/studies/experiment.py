"""One experiment of the paper's section 5: what a learner tried, and what its tuples are worth.

An experiment is a run of episodes, and then fresh trials of what came of it: of the tuple that the
learner recommends, of the cheapest success it ever saw, and of tuples drawn around the
recommendation. This knows outcomes, not how they were come by.
"""

from __future__ import annotations

import math
import statistics

import msgspec
import numpy as np
import numpy.typing as npt

from shearline.learner.interval import wilson
from shearline.learner.region import fold
from shearline.protocol.space import Space

Array = npt.NDArray[np.float64]

#: Spreads of draws around the recommendation, in ranges of each parameter; uniform draws have .29.
SPREADS = (0.03, 0.08, 0.15, 0.22)
#: Parts those draws from all others that a run's seed decides.
_SPREAD_KEY = 0x5B4D


class Outcomes(msgspec.Struct, frozen=True):
    """Trials of one kind.

    Attributes:
        success: Which succeeded ``(trials,)``.
        cost: What each cost ``(trials,)``.
    """

    success: list[bool] = []
    cost: list[float] = []

    @property
    def trials(self) -> int:
        """How many there are."""
        return len(self.success)

    @property
    def wins(self) -> int:
        """How many succeeded."""
        return sum(self.success)

    @property
    def rate(self) -> float:
        """The share that succeeded; ``nan`` without trials."""
        return self.wins / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval, 95 %, of the chance of success."""
        return wilson(self.wins, self.trials)

    @property
    def won_cost(self) -> float:
        """Mean cost of the successes; ``nan`` without any."""
        costs = [cost for cost, won in zip(self.cost, self.success, strict=True) if won]
        return statistics.fmean(costs) if costs else math.nan

    def part(self, start: int, end: int) -> Outcomes:
        """Return trials ``start`` to ``end``, the latter excluded."""
        return Outcomes(self.success[start:end], self.cost[start:end])


class Experiment(msgspec.Struct, frozen=True, kw_only=True):
    """One learner, one seed.

    Attributes:
        contender: Who learned; a learner and its switches have one name.
        task: What was learned.
        plant: On what.
        seed: Of the run.
        episodes: How many.
        learned: Outcomes of the trials it learned from, in order.
        recommended: The tuple it recommends, in task units.
        claimed: Its estimate of that tuple's chance of success.
        claimed_low: Lower end of the interval it states.
        cheapest: The tuple of the cheapest success, in task units; empty if nothing succeeded.
        fresh: Fresh trials of the recommended tuple.
        again: Fresh trials of the cheapest one.
        around: Fresh draws around the recommendation, one trial each, by :data:`SPREADS`.
        engines: What ran the trials.
        trials_s: What all trials took by their evaluators' clocks [s].
        wall_s: What the run took without ``again`` and ``around`` [s].
    """

    contender: str
    task: str
    plant: str
    seed: int
    episodes: int
    learned: Outcomes
    recommended: list[float]
    claimed: float
    claimed_low: float
    cheapest: list[float]
    fresh: Outcomes
    again: Outcomes = Outcomes()
    around: list[Outcomes] = []
    engines: list[str] = []
    trials_s: float = 0.0
    wall_s: float = 0.0

    @property
    def by_episode(self) -> list[Outcomes]:
        """The trials it learned from, episode by episode."""
        length = self.learned.trials // self.episodes
        return [self.learned.part(k * length, (k + 1) * length) for k in range(self.episodes)]

    @property
    def optimised(self) -> float:
        """Cost of the cheapest success; ``nan`` if nothing succeeded."""
        won = zip(self.learned.cost, self.learned.success, strict=True)
        return min((cost for cost, success in won if success), default=math.nan)

    @property
    def bears_out(self) -> bool:
        """Whether what it claims is no more than its fresh trials allow."""
        return self.claimed_low <= self.fresh.interval[1]


def draws_around(space: Space, recommended: list[float], count: int, seed: int) -> list[Array]:
    """Return tuples around a recommendation, in task units: ``count`` of each spread, in order.

    Normal in every parameter and folded back at the bounds, as the learners' own proposals are.

    Args:
        space: What they are tuples of.
        recommended: Their middle ``(n,)``.
        count: Draws of each spread.
        seed: The run's; decides the draws.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, _SPREAD_KEY]))
    middle = space.normalise(np.array(recommended))
    steps = rng.standard_normal((len(SPREADS), count, len(middle)))
    around = fold(middle + np.array(SPREADS)[:, None, None] * steps)
    return list(space.denormalise(around.reshape(-1, len(middle))))
