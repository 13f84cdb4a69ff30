"""A learner on the lock, seed by seed: run through the system, then held to its word.

Each experiment is a run like any other, which ends by trying what was recommended on fresh noise:
the only honest way to say how often it works.
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shearline.deploy.launch import Launch, QuietShow
from shearline.evaluator.plants import DEFAULT
from shearline.learner.run.folder import SUMMARY
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import RecordError

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
        wall_s: How long the run took, fresh trials and all [s].
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
    task: str,
    learner: str,
    seeds: range,
    *,
    evaluators: int,
    fresh: int,
    folder: Path,
    plant: str = DEFAULT,
) -> Iterator[Experiment]:
    """Yield one experiment per seed: 10 episodes of 20 trials, then ``fresh`` trials.

    Runs that the folder holds complete are read, unfinished ones resumed.

    Args:
        task: A built-in task's name.
        learner: Name of the learner.
        seeds: Seeds of the runs.
        evaluators: Processes that run trials.
        fresh: Trials of each recommended tuple, at least 1.
        folder: Where the run folders go.
        plant: What the evaluators act on.

    Raises:
        RunFailed: If a run fails.
        RecordError: If a complete run cannot be read.
        KeyboardInterrupt: If it was interrupted.
    """
    for seed in seeds:
        on = "" if plant == DEFAULT else f"-{plant}"
        run_dir = folder / f"{task}-{learner}-{seed}-{fresh}{on}"
        asked = ["--task", task, "--learner", learner, "--seed", str(seed), "--no-record"]
        launch = Launch(
            run_dir=run_dir,
            listen=free_endpoint(),
            evaluators=evaluators,
            task=None,
            evaluator_arguments=["--plant", plant],
            learner_arguments=[*asked, "--confirm", str(fresh), "--out", str(run_dir)],
        )
        summary = _complete(run_dir) or launch.run(QuietShow())
        if summary["state"] == "stopped":
            raise KeyboardInterrupt
        yield _experiment(seed, summary)


def _complete(run_dir: Path) -> dict[str, Any]:
    """Return the summary of a run that is complete, else nothing."""
    path = run_dir / SUMMARY
    try:
        summary: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    except (OSError, ValueError) as fault:
        raise RecordError(f"cannot read the summary {path}: {fault}") from None
    return summary if summary.get("state") == "complete" else {}


def _experiment(seed: int, summary: dict[str, Any]) -> Experiment:
    fresh = summary["confirmation"]
    rate, cost = fresh["success_rate"], fresh["mean_cost"]
    return Experiment(
        seed=seed,
        success=[episode["success_rate"] for episode in summary["episodes"]],
        claimed=summary["recommendation"]["interval"][0],
        fresh_success=math.nan if rate is None else rate,
        fresh_cost=math.nan if cost is None else cost,
        wall_s=summary["wall_s"],
    )
