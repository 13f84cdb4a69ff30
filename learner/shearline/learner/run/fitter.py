"""The fitter: the learner, in a thread of its own, so that a fit delays no evaluator.

Work goes in by method calls, answers come back as events in the inbox, in the same order. A run
that is resumed is rehearsed first: the learner is asked and told everything again, and must
propose again what the journal says it did.

What the learner recommends when its last episode has closed is its last word if that is to be
confirmed: later outcomes no longer change it.
"""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import SimpleQueue

import numpy as np

from shearline.learner.base import Array, Learner, Recommendation
from shearline.learner.confirmation import tuples
from shearline.learner.dispatcher.book import Book
from shearline.learner.dispatcher.events import LearnerFailed, Planned, ProposalsReady
from shearline.learner.dispatcher.instructions import Ask, Told
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.errors import LearnerError
from shearline.learner.run.seeds import trial_seed
from shearline.protocol.errors import ShearlineError
from shearline.protocol.link import Sink
from shearline.protocol.messages import Purpose, clip

#: Proposals this close to the journal's are the same ones; linear algebra may differ in last bits.
_SAME = 1e-9


@dataclass(frozen=True, slots=True)
class Modelled:
    """The learner's model behind an episode, as JSON text."""

    episode: int
    model: str


@dataclass(frozen=True, slots=True)
class Recommended:
    """The learner's last word; nothing if it has none."""

    recommendation: Recommendation | None


class Fitter:
    """Owns a learner.

    Args:
        make: Returns a fresh learner; called in the thread, as it may be heavy to import.
        seed: The run's.
        inbox: Where answers go.
    """

    def __init__(self, make: Callable[[], Learner], seed: int, inbox: Sink) -> None:
        self._make = make
        self._seed = seed
        self._inbox = inbox
        self._jobs: SimpleQueue[Callable[[Learner], None] | None] = SimpleQueue()
        self._last_word: Recommendation | None = None
        self._thread = threading.Thread(target=self._work, name="fitter", daemon=True)

    def start(self, book: Book) -> None:
        """Start, on what the journal says happened so far."""
        episodes = [
            (purpose, [(n, book.trials[n].theta) for n in numbers])
            for purpose, numbers in zip(book.purposes, book.episodes, strict=True)
        ]
        told = list(book.told)
        self._jobs.put(lambda learner: self._rehearse(learner, episodes, told))
        self._thread.start()

    def ask(self, ask: Ask) -> None:
        """Tell outcomes and have an episode proposed."""
        self._jobs.put(lambda learner: self._ask(learner, ask))

    def finish(self, tells: Sequence[Told]) -> None:
        """Tell the last outcomes, have a recommendation made, and end the thread."""
        self._jobs.put(lambda learner: self._finish(learner, tells))
        self._jobs.put(None)

    def _work(self) -> None:
        try:
            learner = self._make()
            while (job := self._jobs.get()) is not None:
                job(learner)
        except Exception as fault:  # noqa: BLE001 - whatever a learner raises must end the run, not a thread
            why = str(fault) if isinstance(fault, ShearlineError) else repr(fault)
            self._inbox.put(LearnerFailed(clip(f"the learner failed: {why}")))
            self._inbox.put(Recommended(None))

    def _ask(self, learner: Learner, ask: Ask) -> None:
        _tell(learner, ask.tells)
        thetas = self._propose(learner, ask.purpose, ask.trials, ask.first)
        if not all(learner.space.contains(theta) for theta in thetas):
            raise LearnerError(f"a proposal of episode {ask.episode} is out of bounds")
        planned = [
            Planned(n, theta.tolist(), trial_seed(self._seed, n))
            for n, theta in enumerate(thetas, ask.first)
        ]
        self._inbox.put(ProposalsReady(ask.episode, planned))
        if ask.purpose is Purpose.LEARNING:
            self._inbox.put(Modelled(ask.episode, model_json(learner)))
        if ask.episode == 0 and isinstance(learner, EpisodicLearner):
            learner.warm()  # while evaluators have work: at the first update they would wait for it

    def _propose(self, learner: Learner, purpose: Purpose, trials: int, first: int) -> list[Array]:
        """Return the tuples of an episode: the learner's own, or what is to be confirmed."""
        if purpose is not Purpose.LEARNING:
            self._last_word = self._last_word or learner.recommend()
            return tuples(self._last_word, purpose, trials, self._seed)
        proposals = learner.ask(trials)
        if [p.trial for p in proposals] != list(range(first, first + trials)):
            raise LearnerError(f"expected trials from {first} on, got other numbers")
        return [p.theta for p in proposals]

    def _finish(self, learner: Learner, tells: Sequence[Told]) -> None:
        _tell(learner, tells)
        try:
            last_word = self._last_word or learner.recommend()
        except LearnerError:  # nothing was ever asked for
            last_word = None
        self._inbox.put(Recommended(last_word))

    def _rehearse(
        self,
        learner: Learner,
        episodes: list[tuple[Purpose, list[tuple[int, list[float]]]]],
        told: list[tuple[Told, ...]],
    ) -> None:
        """Bring a fresh learner to where the journal ends.

        Raises:
            LearnerError: If it proposes other than it did: outcomes would then be credited to
                tuples that were never tried.
        """
        scale = learner.space.high - learner.space.low
        for episode, (purpose, trials) in enumerate(episodes):
            if episode:
                _tell(learner, told[episode - 1])
            first = trials[0][0] if trials else 0  # without a region there is nothing to draw from
            thetas = self._propose(learner, purpose, len(trials), first)
            for (number, theta), again in zip(trials, thetas, strict=True):
                if np.any(np.abs(again - theta) > _SAME * scale):
                    raise LearnerError(
                        f"trial {number} of this run was proposed by another version of the"
                        " learner: resume it with that version, or start a new run"
                    )


def model_json(learner: Learner) -> str:
    """Return a learner's snapshot as JSON text; what is not finite becomes ``null``."""
    return json.dumps(_plain(learner.snapshot()), allow_nan=False)


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _tell(learner: Learner, tells: Sequence[Told]) -> None:
    for told in tells:
        learner.tell(told.trial, cost=told.cost, success=told.success)
