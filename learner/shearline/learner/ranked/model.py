"""What the ranked learner believes until it looks again, made from the trials told so far.

A model is a value: making one draws nothing and changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.ledger import Trials
from shearline.learner.psp.machine import Machine
from shearline.learner.ranked.config import RankedConfig
from shearline.learner.ranked.cost import Cost, fit_cost
from shearline.learner.ranked.elite import Elite, elite_size, fit_elite
from shearline.learner.ranked.ranking import fit_ranking
from shearline.learner.ranked.reliability import Reliability, fit_reliability
from shearline.learner.ranked.score import failure_price, score
from shearline.learner.ranked.window import window
from shearline.learner.threads import fitting


@dataclass(frozen=True, slots=True)
class Model:
    """One stretch's beliefs.

    Attributes:
        trials: What they rest on, m trials.
        good: Which of them are the elite ``(m,)``.
        reliability: Chance of success.
        cost: Cost of a success.
        price: What a failure costs.
        elite: Where the next trials are drawn from.
        ranking: The partition; ``None`` while everything is elite.
    """

    trials: Trials
    good: npt.NDArray[np.bool_]
    reliability: Reliability
    cost: Cost
    price: float
    elite: Elite
    ranking: Machine | None

    def score(self, u: Array, config: RankedConfig) -> Array:
        """Return the expected cost of one success for tuples ``(m, n)`` as ``(m,)``."""
        p = self.reliability.probability(u, config.pessimism)
        return score(self.cost.mean(u), p, self.price)

    def choose(self, u: Array, config: RankedConfig) -> Array:
        """Return the one of the proposals ``(m, n)`` to try.

        The half of them with the lower expected cost stay; the partition's favourite wins.
        """
        worth = self.score(u, config)
        better = np.argsort(worth, kind="stable")[: (len(u) + 1) // 2]
        if self.ranking is None or not config.use_svm:
            return np.array(u[better[0]])
        values = self.ranking.decision(self.elite.standardise(u[better]))
        return np.array(u[better[int(np.argmax(values))]])


def fit_model(
    trials: Trials, stand: Elite | None, episode_length: int, config: RankedConfig
) -> Model:
    """Make the model.

    Args:
        trials: Everything told; at least one succeeded.
        stand: Where the learner stood before, if it stood anywhere.
        episode_length: Trials of an episode.
        config: Its numbers.
    """
    n = trials.u.shape[1]
    if stand is None:
        cheap = trials.where(trials.success)
        order = np.argsort(cheap.cost, kind="stable")[: elite_size(episode_length, n, len(cheap))]
        stand = fit_elite(cheap.u[order], config.spread)
    scale = np.maximum(stand.deviation, 1e-3)
    seen = window(trials, stand.centre, scale, config.window)
    if not seen.success.any():
        seen = window(trials.where(trials.success), stand.centre, scale, config.window)
    with fitting():
        return _fit(seen, stand.centre, scale, episode_length, config)


def _fit(
    seen: Trials, centre: Array, scale: Array, episode_length: int, config: RankedConfig
) -> Model:
    won = seen.where(seen.success)
    costed = window(won, centre, scale, config.cost_window)
    reliability = fit_reliability(seen.u, seen.success)
    cost = fit_cost(costed.u, costed.cost)
    price = failure_price(seen)
    worth = score(
        cost.mean(won.u) if config.use_gp else won.cost,
        reliability.probability(won.u, config.pessimism if config.use_p else 1.0),
        price,
    )
    size = elite_size(episode_length, seen.u.shape[1], len(won))
    order = np.argsort(worth, kind="stable")[:size]
    elite = fit_elite(won.u[order], config.spread)
    good = np.zeros(len(seen), dtype=np.bool_)
    good[np.flatnonzero(seen.success)[order]] = True
    ranking = fit_ranking(elite.standardise(seen.u), good, config)
    return Model(seen, good, reliability, cost, price, elite, ranking)
