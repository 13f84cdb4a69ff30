"""The task of figure 4: one trial is one whole repeat, a learner on a benchmark function.

Learner and evaluators of the run must agree on what the numbers mean and on the code behind
them: both are part of the task, so that an evaluator with other versions is refused.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shearline.evaluator import task
from shearline.learner.registry import LEARNERS
from shearline.protocol.task import TaskSpec
from shearline.sims.functions import Problem, centred, rastrigin, shifted, sphere
from shearline.studies.benchmark import run_learner
from shearline.studies.provenance import code_of, versions
from shearline.studies.repeat import (
    EPISODE_LENGTH,
    EPISODES,
    Catalogue,
    Job,
    Placement,
    Repeat,
    curve,
    extras,
)

#: How a run names it.
NAME = f"{__name__}:repeat"
#: No learner here takes more than seconds for 400 trials; one that hangs is given up [s].
REPEAT_S_MAX = 3600.0

_CATALOGUE = Catalogue(tuple(LEARNERS))
_FUNCTIONS = {"sphere": sphere, "rastrigin": rastrigin}


def _options() -> dict[str, str | float | bool]:
    versioned = {f"version {name}": text for name, text in versions().items()}
    coded = {f"code {name}": code_of(name) for name in LEARNERS}
    return {"learners": " ".join(LEARNERS), **versioned, **coded}


@task(space=_CATALOGUE.space, trial_s=REPEAT_S_MAX, options=_options())
def repeat(
    theta: Mapping[str, float], rng: np.random.Generator
) -> tuple[float, bool, dict[str, float]]:
    """Run the repeat that a tuple stands for; its cost is the least that the learner found."""
    del rng  # the job's own seed decides everything
    job = _CATALOGUE.decode(list(theta.values()))
    run = run_learner(
        job.learner,
        problem(job),
        episodes=EPISODES,
        episode_length=EPISODE_LENGTH,
        seed=job.seed,
    )
    return run.best, True, extras(run)


def problem(job: Job) -> Problem:
    """Return the problem of a job."""
    function = _FUNCTIONS[job.function]
    if job.placement is Placement.SHIFTED:
        return shifted(function, job.dimensions, job.seed)
    return centred(function, job.dimensions)


def encode(job: Job) -> list[float]:
    """Return the tuple that stands for a job."""
    return _CATALOGUE.encode(job)


def repeat_of(
    task: TaskSpec,
    theta: list[float],
    numbers: Mapping[str, float],
    *,
    run: str,
    trial: int,
    evaluator: str,
) -> Repeat:
    """Read a repeat from what a run keeps of a trial.

    Args:
        task: The run's, which may be of another version than ours.
        theta: The trial's tuple.
        numbers: The result's extras.
        run: The run's name.
        trial: The trial's number.
        evaluator: Who ran it.
    """
    said = {name: str(text) for name, text in task.options.items()}
    job = Catalogue(tuple(said["learners"].split())).decode(theta)
    return Repeat(
        job=job,
        best=curve(numbers, "best"),
        mean=curve(numbers, "mean"),
        learner_s=numbers["learner_s"],
        versions={
            name.removeprefix("version "): text
            for name, text in said.items()
            if name.startswith("version ")
        },
        code=said[f"code {job.learner}"],
        run=run,
        trial=trial,
        evaluator=evaluator,
    )
