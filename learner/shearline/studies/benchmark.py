"""Run learners on problems, seed by seed, and say what they found.

A problem is handed in: this knows no function, no simulator and no task.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from shearline.learner import Learner, Recommendation, Space, create

Array = npt.NDArray[np.float64]


class Problem(Protocol):
    """A space and how one trial in it ends; ``shearline.sims.functions.Problem`` is one."""

    @property
    def name(self) -> str:
        """For tables."""
        ...

    @property
    def space(self) -> Space:
        """Where it is defined."""
        ...

    def trial(self, theta: Array, rng: np.random.Generator) -> tuple[float, bool]:
        """Return cost and success of one trial of one tuple ``(n,)``."""
        ...


@dataclass(frozen=True, slots=True)
class Run:
    """What one learner did on one problem from one seed.

    Attributes:
        theta: Tuples tried ``(trials, n)`` in task units.
        cost: Their costs ``(trials,)``.
        success: Whether they succeeded ``(trials,)``.
        episode_length: Trials per episode.
        learner: As it stands at the end, everything told.
        learner_s: Processor time spent in the learner's proposals [s].
    """

    theta: Array
    cost: Array
    success: npt.NDArray[np.bool_]
    episode_length: int
    learner: Learner
    learner_s: float

    @property
    def recommendation(self) -> Recommendation:
        """Where the learner would stay; made when it is asked for."""
        return self.learner.recommend()

    @property
    def best(self) -> float:
        """Cost of the cheapest success; infinite without one."""
        won = self.cost[self.success]
        return float(won.min()) if len(won) else float("inf")

    def best_every(self, evaluations: int) -> Array:
        """Return the cost of the cheapest success after each so many trials ``(points,)``.

        Infinite before the first success; a rest of fewer trials has no point.
        """
        costs = np.where(self.success, self.cost, np.inf)
        best: Array = np.minimum.accumulate(costs)[evaluations - 1 :: evaluations]
        return best

    @property
    def mean_by_episode(self) -> Array:
        """Mean cost of each episode's trials ``(episodes,)``, failures among them."""
        means: Array = self.cost.reshape(-1, self.episode_length).mean(axis=1)
        return means

    @property
    def success_by_episode(self) -> Array:
        """Share of successes in each episode ``(episodes,)``."""
        shares: Array = self.success.reshape(-1, self.episode_length).mean(axis=1)
        return shares


def run_learner(
    name: str,
    problem: Problem,
    *,
    episodes: int,
    episode_length: int,
    seed: int,
    switches: Mapping[str, object] | None = None,
) -> Run:
    """Let one learner try a problem for whole episodes.

    The problem's noise comes from the seed as well, apart from the learner's own.
    """
    learner = create(name, problem.space, episode_length, seed, **(switches or {}))
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0xBE4C]))
    theta, costs, wins, learner_s = [], [], [], 0.0
    for _ in range(episodes):
        began = time.thread_time()
        proposals = learner.ask(episode_length)
        learner_s += time.thread_time() - began
        for proposal in proposals:
            cost, success = problem.trial(proposal.theta, rng)
            learner.tell(proposal.trial, cost=cost, success=success)
            theta.append(proposal.theta)
            costs.append(cost)
            wins.append(success)
    return Run(
        theta=np.array(theta),
        cost=np.array(costs),
        success=np.array(wins, dtype=np.bool_),
        episode_length=episode_length,
        learner=learner,
        learner_s=learner_s,
    )


@dataclass(frozen=True, slots=True)
class Row:
    """One learner on one problem over many seeds.

    Attributes:
        learner: Its name, or what was switched.
        problem: The problem's name.
        runs: Number of seeds.
        best: Mean over the runs of the cheapest success.
        best_se: Its standard error; ``nan`` for a single run.
        success_late: Share of successes in the last three episodes.
        success_late_se: Its standard error; ``nan`` for a single run.
        learner_s: Mean processor time of one run spent in the learner [s].
    """

    learner: str
    problem: str
    runs: int
    best: float
    best_se: float
    success_late: float
    success_late_se: float
    learner_s: float


def benchmark(
    names: Sequence[str],
    problem: Callable[[int], Problem],
    *,
    seeds: Sequence[int] = range(20),
    episodes: int = 10,
    episode_length: int = 40,
) -> list[Row]:
    """Compare learners on one kind of problem; the defaults are the paper's (its section 4.1).

    Args:
        names: Learners, as :func:`shearline.learner.create` knows them.
        problem: Makes the problem of a seed.
        seeds: One run each.
        episodes: Episodes of a run.
        episode_length: Trials of an episode.

    Example:
        >>> from shearline.sims.functions import shifted, sphere
        >>> rows = benchmark(["random"], lambda seed: shifted(sphere, 20, seed), seeds=range(2))
        >>> rows[0].runs
        2
    """
    return [measure(name, name, {}, problem, seeds, episodes, episode_length) for name in names]


def measure(
    label: str,
    name: str,
    switches: Mapping[str, object],
    problem: Callable[[int], Problem],
    seeds: Sequence[int],
    episodes: int,
    episode_length: int,
) -> Row:
    """Run one learner, with its switches, from every seed and return its row under a label."""
    runs = [
        run_learner(
            name,
            problem(seed),
            episodes=episodes,
            episode_length=episode_length,
            seed=seed,
            switches=switches,
        )
        for seed in seeds
    ]
    return _row(label, runs, problem(seeds[0]).name)


def _row(name: str, runs: list[Run], problem: str) -> Row:
    best = np.array([run.best for run in runs])
    late = np.array([run.success_by_episode[-3:].mean() for run in runs])
    return Row(
        learner=name,
        problem=problem,
        runs=len(runs),
        best=float(best.mean()),
        best_se=standard_error(best),
        success_late=float(late.mean()),
        success_late_se=standard_error(late),
        learner_s=float(np.mean([run.learner_s for run in runs])),
    )


def standard_error(values: Array) -> float:
    """Return the standard error of the mean of values ``(k,)``; ``nan`` for a single one."""
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")
