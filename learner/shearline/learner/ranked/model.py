"""What the ranked learner believes until it looks again, made from the trials told so far.

A model is a value: making one draws nothing and changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.ledger import Trials
from shearline.learner.ranked.config import RankedConfig
from shearline.learner.ranked.cost import Cost, fit_cost
from shearline.learner.ranked.elite import Elite, cheapest, elite_size, fit_elite
from shearline.learner.ranked.reliability import Reliability, fit_reliability
from shearline.learner.ranked.score import failure_price, score
from shearline.learner.ranked.window import window
from shearline.learner.threads import fitting

#: What a fit needs.
LIBRARIES = ("scipy.linalg.lapack", "scipy.optimize")

#: Least length that counts as one step when trials are looked for, in edges of the cube.
STEP_MIN = 1e-3
#: Draws by which the middle is moved, and how many of them it moves to.
MOVE_DRAWS = 300
MOVE_BEST = 30


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
        threshold: Score of the last of the elite; what scores less is the good part of the space.
        pessimism: Deviations by which the chance of success is taken too low.
        heeded: Whether that chance counts in the score at all.
    """

    trials: Trials
    good: npt.NDArray[np.bool_]
    reliability: Reliability
    cost: Cost
    price: float
    elite: Elite
    threshold: float
    pessimism: float
    heeded: bool

    def score(self, u: Array) -> Array:
        """Return the expected cost of one success for tuples ``(m, n)`` as ``(m,)``."""
        return score(self.cost.mean(u), self.chance(u), self.price)

    def chance(self, u: Array) -> Array:
        """Return the chance of success that the score goes by, ``(m,)``."""
        if not self.heeded:
            return np.ones(len(u))
        return self.reliability.probability(u, self.pessimism)

    def first(self, u: Array) -> Array:
        """Return the tuple ``(n,)`` of ``(m, n)`` that ranks first; ties go to the earlier."""
        return np.array(u[int(np.argmin(self.score(u)))])

    def moved(self) -> Model:
        """Return the model with its elite moved to the best tenth of its own draws.

        The draws are the same every time, so that the move is a function of the model alone.
        """
        draws = self.elite.draw(np.random.default_rng(0), MOVE_DRAWS)
        best = np.argsort(self.score(draws), kind="stable")[:MOVE_BEST]
        return replace(self, elite=self.elite.moved(draws[best]))

    def snapshot(self) -> Mapping[str, object]:
        """Return elite, samples and the reliability, which parts the space, as plain values."""
        return {
            "elite": dict(self.elite.snapshot()),
            "price": self.price,
            "threshold": self.threshold,
            "partition": dict(self.reliability.snapshot()),
            "samples": {
                "trial": self.trials.number.tolist(),
                "u": self.trials.u.tolist(),
                "cost": self.trials.cost.tolist(),
                "good": self.good.tolist(),
            },
        }


def fit_model(
    trials: Trials, stand: Elite | None, episode_length: int, config: RankedConfig
) -> Model:
    """Make the model.

    Args:
        trials: Everything told; at least two succeeded.
        stand: Where the learner stood before, if it stood anywhere.
        episode_length: Trials of an episode.
        config: Its numbers.
    """
    if stand is None:
        stand = cheapest(trials, episode_length, config.spread)
    step = np.maximum(stand.deviation, STEP_MIN)
    seen = window(trials, stand.centre, step, config.window)
    won = window(trials.where(trials.success), stand.centre, step, config.cost_window)
    with fitting(*LIBRARIES):
        return _fit(seen, won, episode_length, config)


def _fit(seen: Trials, won: Trials, episode_length: int, config: RankedConfig) -> Model:
    reliability = fit_reliability(seen, won)
    cost = fit_cost(won.u, won.cost)
    price = failure_price(seen, won)
    chance = reliability.probability(won.u, config.pessimism)
    expected = cost.mean(won.u) if config.cost else won.cost
    worth = score(expected, chance if config.reliability else np.ones(len(won)), price)
    size = elite_size(episode_length, won.u.shape[1], len(won))
    order = np.argsort(worth, kind="stable")[:size]
    elite = fit_elite(won.u[order], widened(config, reliability.probability(won.u[order])))
    model = Model(
        trials=seen,
        good=np.isin(seen.number, won.number[order]),
        reliability=reliability,
        cost=cost,
        price=price,
        elite=elite.at_least(config.floor * cost.noise),
        threshold=float(worth[order[-1]]),
        pessimism=config.pessimism,
        heeded=config.reliability,
    )
    for _ in range(config.moves):
        model = model.moved()
    return model


def widened(config: RankedConfig, chance: Array) -> float:
    """Return the factor on the elite's deviations.

    An elite that fails now and then has not arrived: what it does not vary it cannot learn, so
    it is widened by twice the share in which it is expected to fail, up to ``widening``.

    Args:
        config: Spread and widening.
        chance: Expected success ``(k,)`` of the elite.
    """
    return config.spread * (1.0 + min(config.widening, 2.0 * (1.0 - float(chance.mean()))))
