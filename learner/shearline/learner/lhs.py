"""Latin hypercube: every parameter's range is cut into as many strata as there are samples.

Each stratum of each parameter holds exactly one sample. The design of McKay, Beckman and
Conover (1979), Technometrics 21:239-245; the paper's first episode (its section 3.2.1).
"""

from __future__ import annotations

import numpy as np

from shearline.learner.base import Array
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.ledger import Trials


def latin_hypercube(rng: np.random.Generator, samples: int, n: int) -> Array:
    """Draw a latin hypercube design.

    Args:
        rng: Source of randomness.
        samples: Number of samples, at least 1.
        n: Number of parameters.

    Returns:
        Tuples ``(samples, n)`` in [0, 1); in every column each interval
        ``[k, k + 1) / samples`` holds one value.
    """
    strata = np.array([rng.permutation(samples) for _ in range(n)]).T
    return (strata + rng.random((samples, n))) / samples


class LatinHypercube(EpisodicLearner):
    """A fresh latin hypercube in every episode, whatever the outcomes: a baseline."""

    name = "lhs"

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        del episode, trials
        self._design = latin_hypercube(rng, self.episode_length, len(self.space))

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        del rng
        return np.array(self._design[index])
