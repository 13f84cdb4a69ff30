"""One repeat of figure 4: a learner on a benchmark problem from one seed, and what came of it.

A repeat is asked for as a tuple of whole numbers, so that a run can hand it to any evaluator as
one trial. This knows the names of functions, not the functions.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from shearline.studies.benchmark import Run

Array = npt.NDArray[np.float64]

#: The paper's experiment (its section 4.1): k episodes of n_epsilon trials.
EPISODES = 10
EPISODE_LENGTH = 40
#: The paper's functions, and the numbers of parameters "ranging from 5 to 20".
FUNCTIONS = ("sphere", "rastrigin")
DIMENSIONS = (5, 10, 15, 20)
#: A curve has a point every so many evaluations: 40 points, which one result can carry.
EVERY = 10
#: Bounds of the tuple's last two components, far beyond any study.
DIMENSIONS_MAX = 1024
SEEDS_MAX = 2**31


class Placement(enum.StrEnum):
    """Where the optimum lies."""

    CENTRED = "centred"  # in the middle of the box, as the paper has it
    SHIFTED = "shifted"  # somewhere in the middle half of the box, elsewhere for each seed


class Job(msgspec.Struct, frozen=True):
    """What to repeat.

    Attributes:
        function: One of :data:`FUNCTIONS`.
        placement: Where its optimum lies.
        dimensions: Number of parameters.
        learner: Its name.
        seed: Decides the learner's draws and, if shifted, the optimum.
    """

    function: str
    placement: Placement
    dimensions: int
    learner: str
    seed: int


class Repeat(msgspec.Struct, frozen=True, kw_only=True):
    """What one repeat came to; one line of a study's results.

    Attributes:
        job: What was asked for.
        best: Least cost after each :data:`EVERY` evaluations, never rising.
        mean: Mean cost of each episode's trials.
        learner_s: Processor time spent in the learner [s].
        versions: Of Python, Shearline and what the learners stand on.
        code: Digest of the learner's source.
        run: Run that the repeat was a trial of.
        trial: Its number there.
        evaluator: Who ran it.
    """

    job: Job
    best: list[float]
    mean: list[float]
    learner_s: float
    versions: dict[str, str]
    code: str
    run: str
    trial: int
    evaluator: str


@dataclass(frozen=True, slots=True)
class Catalogue:
    """The numbers that stand for jobs in a run.

    Args:
        learners: Every learner that may be asked for; its place is its number.
    """

    learners: tuple[str, ...]

    @property
    def space(self) -> dict[str, tuple[str, float, float]]:
        """The space of jobs, as a task declares it."""
        return {
            "function": ("", 0.0, len(FUNCTIONS) - 1.0),
            "placement": ("", 0.0, len(Placement) - 1.0),
            "dimensions": ("", 1.0, float(DIMENSIONS_MAX)),
            "learner": ("", 0.0, max(1.0, len(self.learners) - 1.0)),
            "seed": ("", 0.0, float(SEEDS_MAX)),
        }

    def encode(self, job: Job) -> list[float]:
        """Return a job as a tuple ``(5,)`` of the space.

        Raises:
            ValueError: If the catalogue has no such function or learner.
        """
        return [
            float(FUNCTIONS.index(job.function)),
            float(list(Placement).index(job.placement)),
            float(job.dimensions),
            float(self.learners.index(job.learner)),
            float(job.seed),
        ]

    def decode(self, values: Sequence[float]) -> Job:
        """Return the job of a tuple ``(5,)``, whose values are whole but for the last bits."""
        function, placement, dimensions, learner, seed = (round(value) for value in values)
        return Job(
            function=FUNCTIONS[function],
            placement=list(Placement)[placement],
            dimensions=dimensions,
            learner=self.learners[learner],
            seed=seed,
        )


def jobs(
    learners: Sequence[str],
    *,
    functions: Sequence[str] = FUNCTIONS,
    placements: Sequence[Placement] = tuple(Placement),
    dimensions: Sequence[int] = DIMENSIONS,
    seeds: Sequence[int] = range(50),
) -> list[Job]:
    """Return every combination, the seeds of one learner on one problem side by side."""
    return [
        Job(function, placement, n, learner, seed)
        for function in functions
        for placement in placements
        for n in dimensions
        for learner in learners
        for seed in seeds
    ]


def extras(run: Run) -> dict[str, float]:
    """Return a run's curves as the named numbers that a result can carry."""
    best = {f"best_{i}": float(value) for i, value in enumerate(run.best_every(EVERY))}
    mean = {f"mean_{i}": float(value) for i, value in enumerate(run.mean_by_episode)}
    return {**best, **mean, "learner_s": run.learner_s}


def curve(numbers: Mapping[str, float], kind: str) -> list[float]:
    """Return one curve, ``"best"`` or ``"mean"``, from what :func:`extras` made."""
    points = sum(name.startswith(f"{kind}_") for name in numbers)
    return [numbers[f"{kind}_{i}"] for i in range(points)]
