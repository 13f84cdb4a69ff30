"""The ranked learner: draw around the elite, try what ranks first, never trust a lucky success."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from shearline.learner.base import Array
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.ledger import Trials
from shearline.learner.lhs import latin_hypercube
from shearline.learner.ranked.config import RankedConfig
from shearline.learner.ranked.elite import Elite
from shearline.learner.ranked.model import LIBRARIES, Model, fit_model
from shearline.learner.recommend import Focus
from shearline.learner.region import fold
from shearline.protocol.space import Space

#: Least spread that is claimed around a recommendation, in edges of the cube.
SCALE_MIN = 1e-3


class RankedPSP(EpisodicLearner):
    """PSP whose partition ranks.

    Args:
        space: What is being learned.
        episode_length: Trials of an episode.
        seed: 0 or more.
        config: Its numbers.
    """

    name = "psp-ranked"
    libraries = LIBRARIES
    primes = True

    def __init__(self, space: Space, episode_length: int, seed: int, config: RankedConfig) -> None:
        super().__init__(space, episode_length, seed)
        self.config = config
        self._design: Array = np.empty((0, len(space)))
        self._belief: Model | None = None
        self._wins: Array = np.empty((0, len(space)))

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        del episode
        self._design = latin_hypercube(rng, self.episode_length, len(self.space))
        if len(trials):
            self._renew(trials)

    def _renew(self, trials: Trials) -> None:
        self._wins = trials.u[trials.success]
        if len(self._wins) >= self.config.wins_min:
            stand = self._stand()
            self._belief = fit_model(trials, stand, self.episode_length, self.config)

    def _stand(self) -> Elite | None:
        return None if self._belief is None else self._belief.elite

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        if self.config.refresh and index and index % self.config.refresh == 0:
            self._renew(self._ledger.known(self._ledger.asked // self.episode_length))
        if self._belief is None:
            return self._scout(index, rng)
        return self._belief.first(self._belief.elite.draw(rng, self.config.draws))

    def _scout(self, index: int, rng: np.random.Generator) -> Array:
        """Return a tuple of the design or, every other time, one near a success."""
        if len(self._wins) and index % 2:
            near = self._wins[rng.integers(len(self._wins))]
            offset = self.config.scout_spread * rng.standard_normal(len(near))
            return fold(near + offset)
        return np.array(self._design[index])

    def _focus(self, trials: Trials) -> Focus:
        """Return the elite that the next episode would draw from."""
        if int(trials.success.sum()) < self.config.wins_min:
            return super()._focus(trials)
        elite = fit_model(trials, self._stand(), self.episode_length, self.config).elite
        return Focus(elite.centre, np.maximum(elite.deviation, SCALE_MIN))

    def _model(self) -> Mapping[str, object]:
        if self._belief is None:
            return {"config": asdict(self.config), "proposal": "scouts"}
        return {"config": asdict(self.config), "proposal": "elite", **self._belief.snapshot()}


def ranked(space: Space, episode_length: int = 20, seed: int = 0, **switches: object) -> RankedPSP:
    """Make ``psp-ranked``."""
    return RankedPSP(space, episode_length, seed, RankedConfig().having(**switches))
