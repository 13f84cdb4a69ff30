"""Uniform random search: the baseline that knows nothing."""

from __future__ import annotations

import numpy as np

from shearline.learner.base import Array
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.ledger import Trials


class RandomSearch(EpisodicLearner):
    """Independent uniform tuples, whatever the outcomes."""

    name = "random"

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        """Learn nothing."""

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        del index
        return rng.random(len(self.space))
