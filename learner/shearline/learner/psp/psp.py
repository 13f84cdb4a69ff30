"""PSP, the paper's learner: propose, filter, label, and part the space anew with every episode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.ledger import Trials
from shearline.learner.lhs import latin_hypercube
from shearline.learner.psp.config import Exhausted, MixtureData, PSPConfig
from shearline.learner.psp.partition import Partition, fit_partition
from shearline.learner.psp.proposal import Mixture, draw_inside, fit_mixture
from shearline.learner.psp.reward import UNBOUNDED, rewards, update
from shearline.learner.recommend import Focus
from shearline.learner.threads import fitting
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

    def __init__(
        self, space: Space, episode_length: int, seed: int, config: PSPConfig, name: str = "psp"
    ) -> None:
        super().__init__(space, episode_length, seed)
        self.config = config
        self.name = name
        self._design: Array | None = None
        self._threshold_cost = UNBOUNDED
        self._components: int | None = None
        self._mixture: Mixture | None = None
        self._partition: Partition | None = None
        self._trials: Trials = self._ledger.trials()
        self._good: npt.NDArray[np.bool_] = np.zeros(0, dtype=np.bool_)

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        self._design = None
        if episode == 0:
            self._design = latin_hypercube(rng, self.episode_length, len(self.space))
            return
        self._trials = trials
        self._good, self._threshold_cost = update(
            trials, self._threshold_cost, self.config.labels, self.config.reward
        )
        wins = int(trials.success.sum())
        with fitting():
            if wins >= self.config.proposal_min:
                self._fit_mixture(rng)
            if wins >= self.config.filter_min:
                chosen = working_set(trials, self._good, self.config.fit_samples_max)
                self._partition = fit_partition(trials.u[chosen], self._good[chosen], self.config)

    def _fit_mixture(self, rng: np.random.Generator) -> None:
        chosen = mixture_samples(self._trials, self._good, self.config)
        seed = int(rng.integers(2**31))
        self._mixture, self._components = fit_mixture(chosen, self._components, seed, self.config)

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        if self._design is not None:
            return np.array(self._design[index])
        if self._partition is None:
            return np.array(self._propose(1, rng)[0])
        return self._filtered(self._partition, rng)

    def _propose(self, count: int, rng: np.random.Generator) -> Array:
        if self._mixture is None:
            return rng.random((count, len(self.space)))
        return draw_inside(self._mixture, rng, count, self.config.outside)

    def _filtered(self, partition: Partition, rng: np.random.Generator) -> Array:
        """Return the first accepted proposal, or after ``redraws_max`` what ``exhausted`` says."""
        best, best_value = np.empty(0), -np.inf
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
        return super()._focus(trials)

    def _model(self) -> Mapping[str, object]:
        proposal = "mixture" if self._mixture else "uniform"
        return {
            "config": {name: _plain(value) for name, value in asdict(self.config).items()},
            "proposal": "lhs" if self._design is not None else proposal,
            "threshold_cost": None if self._threshold_cost == UNBOUNDED else self._threshold_cost,
            "mean_reward": self._mean_reward(),
            "mixture": None if self._mixture is None else dict(self._mixture.snapshot()),
            "partition": None if self._partition is None else dict(self._partition.snapshot()),
            "samples": {
                "trial": self._trials.number.tolist(),
                "u": self._trials.u.tolist(),
                "reward": rewards(self._trials, self.config.reward).tolist(),
                "good": self._good.tolist(),
            },
        }

    def _mean_reward(self) -> float:
        """Return rbar: the mean reward of the good samples under the present map, 0 at first."""
        if not self._good.any():
            return 0.0
        return float(rewards(self._trials, self.config.reward)[self._good].mean())


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value


def mixture_samples(trials: Trials, good: npt.NDArray[np.bool_], config: PSPConfig) -> Array:
    """Return the samples ``(k, n)`` the mixture is fitted to, at most ``fit_samples_max``.

    With ``positives``, the cheapest successes fill up to ``proposal_min`` where fewer are
    positive: a component needs something to be wide on.
    """
    won = trials.where(trials.success)
    if config.mixture_data is MixtureData.SUCCESSES:
        return won.u[-config.fit_samples_max :]
    count = min(max(int(good.sum()), config.proposal_min), config.fit_samples_max)
    # Good samples are the cheapest successes by definition; ties go to the earlier trial.
    return won.u[np.argsort(won.cost, kind="stable")[:count]]


def working_set(
    trials: Trials, good: npt.NDArray[np.bool_], samples_max: int
) -> npt.NDArray[np.int64]:
    """Return the indices ``(k,)`` of the samples the filter is fitted to, in order.

    All of them up to ``samples_max``; beyond, the cheapest positives up to half of that and the
    latest negatives, which lie where proposals are drawn now.
    """
    if len(trials) <= samples_max:
        return np.arange(len(trials))
    plus, minus = np.flatnonzero(good), np.flatnonzero(~good)
    room = max(samples_max // 2, samples_max - len(minus))
    plus = plus[np.argsort(trials.cost[plus], kind="stable")[:room]]
    minus = minus[-(samples_max - len(plus)) :]
    return np.sort(np.concatenate([plus, minus]))


def working(space: Space, episode_length: int = 20, seed: int = 0, **switches: object) -> PSP:
    """Make ``psp``: the reading of the paper that works."""
    return PSP(space, episode_length, seed, PSPConfig().having(**switches), "psp")


def literal(space: Space, episode_length: int = 20, seed: int = 0, **switches: object) -> PSP:
    """Make ``psp-paper``: the reading that is written."""
    return PSP(space, episode_length, seed, PSPConfig.paper().having(**switches), "psp-paper")
