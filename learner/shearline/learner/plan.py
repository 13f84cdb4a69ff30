"""A plan: the tuples to try are given beforehand, and nothing is learned.

It lets anything that is a list of tuples (a sweep, a study, a replay on another plant) travel
through a run like any other: handed out, journaled, resumed. It knows no cost.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shearline.learner.base import Array
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.errors import LearnerError, SwitchError
from shearline.learner.ledger import Trials
from shearline.protocol.space import Space


class Plan(EpisodicLearner):
    """The given tuples, each once and in order.

    Args:
        space: What they are tuples of.
        episode_length: Trials of one episode.
        seed: Of no consequence.
        tuples: ``(trials, n)`` in task units, within the bounds; they are tried as they stand,
            but for the last bits, which a way through the unit cube may change.

    Raises:
        SwitchError: If there are none, or one is malformed or out of bounds.
    """

    name = "plan"

    def __init__(
        self,
        space: Space,
        episode_length: int = 20,
        seed: int = 0,
        tuples: Sequence[Sequence[float]] = (),
    ) -> None:
        super().__init__(space, episode_length, seed)
        if not tuples or any(len(one) != len(space) for one in tuples):
            raise SwitchError(
                f"a plan takes tuples of {len(space)} values each, got {len(tuples)} tuples:"
                " list them under switches.tuples"
            )
        self._u = space.normalise(np.array(tuples, dtype=np.float64))
        inside = np.all((self._u >= 0.0) & (self._u <= 1.0), axis=1)
        if not inside.all():
            wrong = int(np.flatnonzero(~inside)[0])
            raise SwitchError(f"tuple {wrong} of the plan is out of bounds: {list(tuples[wrong])}")
        self._first = 0

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        del trials, rng
        self._first = episode * self.episode_length

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        del rng
        trial = self._first + index
        if trial >= len(self._u):
            raise LearnerError(
                f"the plan has {len(self._u)} tuples, and one more was asked for:"
                " ask for fewer, or list more"
            )
        return np.array(self._u[trial])
