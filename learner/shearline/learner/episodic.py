"""Ask and tell, once for all learners that renew themselves from episode to episode.

A learner derives from :class:`EpisodicLearner` and says three things: what it makes of the
trials told when an episode begins, how it draws one tuple, and where it would stand if it had to
choose now. Numbering, bounds, episode boundaries, seeds and misuse are settled here.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

from shearline.learner.base import Array, Proposal, Recommendation
from shearline.learner.errors import LearnerError
from shearline.learner.ledger import Ledger, Trials
from shearline.learner.prior import Prior
from shearline.learner.recommend import Focus, elite_focus, recommendation
from shearline.learner.threads import load
from shearline.protocol.space import Space

#: More proposals in one call than any run has trials; a slip in units, not a wish.
ASK_MAX = 1_000_000


class EpisodicLearner(ABC):
    """Base of learners whose model changes only between episodes.

    Args:
        space: What is being learned.
        episode_length: Trials of one episode, at least 1.
        seed: Any non-negative integer; the same seed and outcomes give the same proposals.

    Raises:
        LearnerError: If the episode length or the seed is out of range.
    """

    #: Name under which :func:`shearline.learner.create` knows it.
    name: str

    #: Modules that renewing the model needs and that take up to a second to load.
    libraries: tuple[str, ...] = ()

    #: Whether it can start from the trials of another run; its model must then take any trials.
    primes = False

    def __init__(self, space: Space, episode_length: int = 20, seed: int = 0) -> None:
        if episode_length < 1:
            raise LearnerError(f"an episode has at least 1 trial, got {episode_length}")
        if seed < 0:
            raise LearnerError(f"a seed is 0 or more, got {seed}")
        self.space = space
        self.episode_length = episode_length
        self.seed = seed
        self._ledger = Ledger(len(space))
        self._rng = np.random.default_rng()

    # -- for those who derive ------------------------------------------------------------------

    @abstractmethod
    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        """Renew the model for one episode from everything told until now, and the prior."""

    @abstractmethod
    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        """Return the tuple ``(n,)`` in [0, 1]^n of one trial, the ``index``-th of its episode."""

    def _focus(self, trials: Trials) -> Focus:
        """Return where the learner stands, in unit coordinates; by default among its elite."""
        return elite_focus(trials, len(self.space))

    def _model(self) -> Mapping[str, object]:
        """Return the model as plain values for :meth:`snapshot`."""
        return {}

    # -- the contract --------------------------------------------------------------------------

    def ask(self, n: int) -> list[Proposal]:
        """Return ``n`` new proposals; see :class:`shearline.learner.base.Learner`."""
        if not 1 <= n <= ASK_MAX:
            raise LearnerError(f"ask for 1 to {ASK_MAX} proposals, got {n!r}")
        return [self._next() for _ in range(n)]

    def tell(self, trial: int, *, cost: float, success: bool) -> None:
        """Report one outcome; see :class:`shearline.learner.base.Learner`."""
        self._ledger.tell(trial, cost, success=success)

    def recommend(self) -> Recommendation:
        """Return a robust tuple; see :class:`shearline.learner.base.Learner`.

        A prior may say where to stand, never what is claimed for it.
        """
        if not self._ledger.asked:
            raise LearnerError("nothing has been asked for yet: ask and tell before recommend")
        begun = -(-self._ledger.asked // self.episode_length)
        focus = self._focus(self._ledger.known(begun))
        return recommendation(self.space, self._ledger.trials(), focus)

    def prime(self, prior: Prior) -> None:
        """Start from the trials of another run, before anything is asked for.

        Raises:
            LearnerError: If this learner cannot, or something was asked for.
        """
        if not self.primes:
            raise LearnerError(f"{self.name} cannot start from another run: choose another learner")
        if self._ledger.asked:
            raise LearnerError("trials were asked for already: start from another run before that")
        u = np.clip(self.space.normalise(np.array(prior.theta)), 0.0, 1.0)
        self._ledger.prime(u, np.array(prior.cost), np.array(prior.success, dtype=np.bool_))

    def warm(self) -> None:
        """Load what the first fit needs; for whoever has time before it. By default nothing."""
        load(*self.libraries)

    def snapshot(self) -> Mapping[str, object]:
        """Return the model as plain numbers, strings, lists and dicts.

        Always there: ``learner``, ``episode`` (of the latest proposal, -1 before any),
        ``names``, ``low``, ``high`` of the space. The rest lives in unit coordinates and
        belongs to the learner.
        """
        return {
            "learner": self.name,
            "episode": (self._ledger.asked - 1) // self.episode_length,
            "names": list(self.space.names),
            "low": self.space.low.tolist(),
            "high": self.space.high.tolist(),
            **self._model(),
        }

    def _next(self) -> Proposal:
        episode, index = divmod(self._ledger.asked, self.episode_length)
        if index == 0:
            # One generator per episode, from the seed alone: what an episode draws cannot depend
            # on how many numbers the ones before it used up.
            self._rng = np.random.default_rng(np.random.SeedSequence([self.seed, episode]))
            self._begin(episode, self._ledger.known(episode), self._rng)
        u = np.clip(self._draw(index, self._rng), 0.0, 1.0)
        trial = self._ledger.add(u)
        return Proposal(trial=trial, theta=self.space.denormalise(u))
