"""PSP, the paper's learner: propose, filter, label, and part the space anew with every episode."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shearline.learner.base import Array
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.ledger import Trials
from shearline.learner.lhs import latin_hypercube
from shearline.learner.psp.config import Exhausted, PSPConfig
from shearline.learner.psp.focus import component_focus
from shearline.learner.psp.model import LIBRARIES, Model, renew
from shearline.learner.psp.partition import Partition
from shearline.learner.psp.proposal import draw_inside
from shearline.learner.psp.reward import rewards
from shearline.learner.recommend import Focus
from shearline.learner.switches import plain
from shearline.protocol.space import Space

#: Proposals judged at a time; the first accepted one of a block is applied.
BLOCK = 16


class PSP(EpisodicLearner):
    """Parameter space partitioning (algorithm 1 of the paper).

    Args:
        space: What is being learned.
        episode_length: n_epsilon, trials between two updates.
        seed: 0 or more.
        config: The reading of the paper.
        name: Name it was created under.
    """

    libraries = LIBRARIES
    primes = True

    def __init__(
        self, space: Space, episode_length: int, seed: int, config: PSPConfig, name: str = "psp"
    ) -> None:
        super().__init__(space, episode_length, seed)
        self.config = config
        # A look ahead for the recommendation needs no filter, which is the costly part.
        self._without_filter = replace(config, filter_min=2**62)
        self.name = name
        self._design: Array | None = None
        self._belief = Model(self._ledger.trials(), np.zeros(0, dtype=np.bool_))

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        if episode == 0 and not len(trials):
            self._design = latin_hypercube(rng, self.episode_length, len(self.space))
            return
        self._design = None
        self._belief = renew(self._belief, trials, self.seed % 2**32, self.config)

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        if self._design is not None:
            return np.array(self._design[index])
        if self._belief.partition is None:
            return np.array(self._propose(1, rng)[0])
        return self._filtered(self._belief.partition, rng)

    def _propose(self, count: int, rng: np.random.Generator) -> Array:
        if self._belief.mixture is None:
            return rng.random((count, len(self.space)))
        return draw_inside(self._belief.mixture, rng, count, self.config.outside)

    def _filtered(self, partition: Partition, rng: np.random.Generator) -> Array:
        """Return the first accepted proposal, or after ``redraws_max`` what ``exhausted`` says."""
        best, best_value = np.empty(0), -math.inf
        for start in range(0, self.config.redraws_max, BLOCK):
            block = self._propose(min(BLOCK, self.config.redraws_max - start), rng)
            values = partition.decision(block)
            accepted = np.flatnonzero(values >= 0.0)
            if len(accepted):
                return np.array(block[accepted[0]])
            top = int(np.argmax(values)) if self.config.exhausted is Exhausted.BEST else -1
            if self.config.exhausted is Exhausted.LAST or values[top] > best_value:
                best, best_value = block[top], float(values[top])
        return np.array(best)

    def _focus(self, trials: Trials) -> Focus:
        """Return the best component of the mixture that the next episode would draw from."""
        mixture = renew(self._belief, trials, self.seed % 2**32, self._without_filter).mixture
        return super()._focus(trials) if mixture is None else component_focus(mixture, trials)

    def _model(self) -> Mapping[str, object]:
        belief = self._belief
        worth = rewards(belief.trials, self.config.reward)
        proposal = "mixture" if belief.mixture else "uniform"
        return {
            "config": plain(self.config),
            "proposal": "lhs" if self._design is not None else proposal,
            "threshold_cost": _finite(belief.threshold_cost),
            "mean_reward": float(worth[belief.good].mean()) if belief.good.any() else 0.0,
            "mixture": None if belief.mixture is None else dict(belief.mixture.snapshot()),
            "partition": None if belief.partition is None else dict(belief.partition.snapshot()),
            "samples": {
                "trial": belief.trials.number.tolist(),
                "u": belief.trials.u.tolist(),
                "cost": belief.trials.cost.tolist(),
                "reward": worth.tolist(),
                "good": belief.good.tolist(),
            },
        }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def working(space: Space, episode_length: int = 20, seed: int = 0, **switches: object) -> PSP:
    """Make ``psp``: the reading of the paper that works."""
    return PSP(space, episode_length, seed, PSPConfig().having(**switches), "psp")


def literal(space: Space, episode_length: int = 20, seed: int = 0, **switches: object) -> PSP:
    """Make ``psp-paper``: the reading that is written."""
    return PSP(space, episode_length, seed, PSPConfig.paper().having(**switches), "psp-paper")
