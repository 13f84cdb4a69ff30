"""The learner on the lock, seed by seed: run through the system, then held to its word.

Each experiment is a run like any other (Zenoh, evaluators, journal). Afterwards the recommended
tuple is tried on fresh noise, which is the only honest way to say how often it works.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from shearline.deploy.launch import Launch, QuietShow
from shearline.evaluator.builtin import builtin_task
from shearline.evaluator.local import run_trial
from shearline.learner.run.seeds import trial_seed
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.messages import OutcomeKind
from shearline.protocol.space import Space

#: Fresh trials are numbered from here: no run has that many, so their noise is new.
FRESH_FROM = 1_000_000
#: "Late" are the last three episodes, as in the tables of the docs.
LATE_EPISODES = 3


@dataclass(frozen=True, slots=True)
class Experiment:
    """One run on the lock.

    Attributes:
        seed: The run's.
        success: Success rate of each episode.
        claimed: Lower end of the interval the learner states for its recommendation.
        fresh_success: Share of fresh trials in which the recommendation worked.
        fresh_cost: Mean cost of those successes [s]; ``nan`` without any.
        wall_s: How long the run took [s].
    """

    seed: int
    success: list[float]
    claimed: float
    fresh_success: float
    fresh_cost: float
    wall_s: float

    @property
    def late_success(self) -> float:
        """Mean success rate of the last three episodes."""
        return statistics.fmean(self.success[-LATE_EPISODES:])


def experiments(
    task: str, learner: str, seeds: range, *, evaluators: int, fresh: int, folder: Path
) -> Iterator[Experiment]:
    """Yield one experiment per seed: 10 episodes of 20 trials, then ``fresh`` trials.

    Args:
        task: A built-in task's name.
        learner: Name of the learner.
        seeds: Seeds of the runs.
        evaluators: Processes that run trials.
        fresh: Trials of each recommended tuple, at least 1.
        folder: Where the run folders go.

    Raises:
        RunFailed: If a run fails.
    """
    for seed in seeds:
        run_dir = folder / f"{task}-{learner}-{seed}"
        asked = ["--task", task, "--learner", learner, "--seed", str(seed), "--no-record"]
        launch = Launch(
            run_dir=run_dir,
            listen=free_endpoint(),
            evaluators=evaluators,
            task=None,
            learner_arguments=[*asked, "--out", str(run_dir)],
        )
        summary = launch.run(QuietShow())
        advice = summary["recommendation"]
        rate, cost = _held_to(task, advice["theta"], seed, fresh)
        yield Experiment(
            seed=seed,
            success=[episode["success_rate"] for episode in summary["episodes"]],
            claimed=advice["interval"][0],
            fresh_success=rate,
            fresh_cost=cost,
            wall_s=summary["wall_s"],
        )


def _held_to(task: str, theta: dict[str, float], seed: int, fresh: int) -> tuple[float, float]:
    """Return the share of successes and their mean cost over fresh trials of one tuple."""
    one = builtin_task(task)
    values = Space(one.spec.space).to_array(theta)
    verdicts = [run_trial(one, values, trial_seed(seed, FRESH_FROM + i)) for i in range(fresh)]
    costs = [verdict.cost for verdict in verdicts if verdict.kind is OutcomeKind.SUCCESS]
    return len(costs) / fresh, statistics.fmean(costs) if costs else float("nan")
