"""CMA-ES, the covariance matrix adaptation evolution strategy, through the ``cma`` package.

Hansen, Akimoto and Baudis's package (BSD licence) does the search; this translates: trials that
come back late or never into generations, failures into costs. It knows nothing of how
the package adapts.
"""

from __future__ import annotations

import copy
import enum
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shearline.learner.base import Array
from shearline.learner.charge import Failures, charged
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.errors import LearnerError
from shearline.learner.ledger import Trials
from shearline.learner.recommend import Focus, elite_focus
from shearline.learner.switches import check, having, plain
from shearline.learner.threads import fitting
from shearline.protocol.space import Space

#: What a generation needs.
LIBRARIES = ("cma",)
#: Fewest solutions of a generation: below, the package would need mirrored ones.
POPULATION_MIN = 4
#: The package has no one-dimensional search: a second coordinate is added there, and ignored.
DIMENSIONS_MIN = 2
#: Least standard deviation of a focus, in units of the cube's edge.
SCALE_MIN = 0.001


class Population(enum.StrEnum):
    """For how many solutions the package sets its rates and weights."""

    PACKAGE = "package"  # 4 + 3 log n, however many an episode has: it selects its best as sharply
    EPISODE = "episode"  # as many as an episode has


class Boundary(enum.StrEnum):
    """Which of the package's boundary handlers keeps solutions in the box."""

    TRANSFORM = "transform"  # the package's default: the search space is folded at the walls
    PENALTY = "penalty"  # solutions are put on the wall and charged for it


@dataclass(frozen=True, slots=True)
class CMAESConfig:
    """What the package leaves to its user, and what our episodes add.

    Attributes:
        population: Size of a generation that the package is set for. An episode is one
            generation in either case.
        start: Where every parameter starts, as a share of its range: .5 is the middle of the box,
            .1 near its low end, as in experiments of the paper's authors.
        spread: Standard deviation at the start as a share of the range; the authors' public
            code (MIOS) takes .2, and the package advises that the optimum lie within three of them.
        boundary: The boundary handler.
        failures: Whether failures differ among themselves. Costs only count by their rank within
            a generation.
    """

    population: Population = Population.PACKAGE
    start: float = 0.5
    spread: float = 0.2
    boundary: Boundary = Boundary.TRANSFORM
    failures: Failures = Failures.ALIKE

    def __post_init__(self) -> None:
        check(0 <= self.start <= 1, "cmaes", "start", "0 to 1", self.start)
        check(self.spread > 0, "cmaes", "spread", "above 0", self.spread)


class CMAES(EpisodicLearner):
    """The package's ask and tell behind ours.

    Outcomes wait in line, by trial number, until an episode begins. Then all that wait are told as
    one generation, each once; fewer than the package can select from wait on. So a missing trial
    costs its own information and nothing else. A late one belongs to a distribution that has moved
    on: the package shortens its step to a plausible length, as it does with any foreign solution.

    An episode is never told as several generations: the package takes each for a sample around a
    mean that has moved since, and its steps shrink to nothing (5-D sphere: stuck at .03).

    After another run it starts in the middle of the cheaper half of that run's successes, as wide
    as ever; the trials themselves are never told, for they are no sample of its distribution.

    Args:
        space: What is being learned.
        episode_length: Trials between two updates.
        seed: 0 or more.
        switches: Fields of :class:`CMAESConfig`.

    Raises:
        LearnerError: If the ``cma`` package is not installed.
    """

    name = "cmaes"
    primes = True
    libraries = LIBRARIES

    def __init__(
        self, space: Space, episode_length: int = 20, seed: int = 0, **switches: object
    ) -> None:
        super().__init__(space, episode_length, seed)
        self.config = having(CMAESConfig(), self.name, switches)
        self._normal = np.random.default_rng()
        self._strategy: Any = None
        self._solutions: list[Array] = []
        self._batch = np.empty((0, len(space)))
        self._told: set[int] = set()

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        self._normal = rng
        with fitting(*LIBRARIES), warnings.catch_warnings():
            # It warns of generations larger than it was set for, which it handles: the weights
            # then go to the best and the worst.
            warnings.simplefilter("ignore")
            if self._strategy is None:
                self._strategy = self._make(self._start(trials))
            self._told.update(self._tell_waiting(self._strategy, episode, trials))
            asked = self._strategy.ask(self.episode_length)
        self._solutions += [np.array(x) for x in asked]
        self._batch = np.array(asked)[:, : len(self.space)]

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        del rng
        return np.array(self._batch[index])

    def _start(self, prior: Trials) -> Array:
        """Return where the search starts: ``(n,)``, but two numbers where n is 1."""
        n = len(self.space)
        start = np.full(max(DIMENSIONS_MIN, n), self.config.start)
        if prior.success.any():
            start[:n] = elite_focus(prior, n).centre
        return start

    def _make(self, start: Array) -> Any:
        """Return the package's strategy on the unit cube, with its numbers from our generator."""
        try:
            # It ships no type information.
            import cma  # type: ignore[import-untyped]  # noqa: PLC0415 - heavy, at the first ask
        except ImportError:
            raise LearnerError(
                "cmaes needs the package cma: install shearline with the extra 'learner'"
            ) from None
        handlers = {
            Boundary.TRANSFORM: cma.BoundTransform,
            Boundary.PENALTY: cma.BoundPenalty,
        }
        options = {
            "bounds": [0.0, 1.0],
            "BoundaryHandler": handlers[self.config.boundary],
            "randn": lambda *shape: self._normal.standard_normal(shape),
            "seed": np.nan,  # its word for "leave numpy's global generator alone"
            "CMA_mirrors": 0,
            "verbose": -9,
        }
        if self.config.population is Population.EPISODE:
            options["popsize"] = max(POPULATION_MIN, self.episode_length)
        return cma.CMAEvolutionStrategy(start, self.config.spread, options)

    def _tell_waiting(self, strategy: Any, episode: int, trials: Trials) -> list[int]:
        """Tell a strategy, as one generation, what ours was not told; return whose numbers."""
        trials = trials.where(trials.number >= 0)
        told = [k in self._told for k in trials.number.tolist()]
        waiting = np.flatnonzero(~np.array(told, dtype=np.bool_))
        if len(waiting) < max(POPULATION_MIN, int(strategy.sp.weights.mu)):
            return []
        numbers: list[int] = trials.number[waiting].tolist()
        solutions = [self._solutions[k] for k in numbers]
        cost = charged(trials, self.config.failures)[waiting]
        late = [i for i, k in enumerate(numbers) if k // self.episode_length < episode - 1]
        strategy.tell(solutions, cost.tolist(), check_points=late)
        return numbers

    def _focus(self, trials: Trials) -> Focus:
        """Return the distribution that the next episode would be drawn from."""
        if self._strategy is None or not trials.success.any():
            return super()._focus(trials)
        ahead = copy.deepcopy(self._strategy)
        begun = -(-self._ledger.asked // self.episode_length)
        with fitting(*LIBRARIES), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._tell_waiting(ahead, begun, trials)
        n = len(self.space)
        scale = np.maximum(np.asarray(ahead.result.stds, dtype=np.float64)[:n], SCALE_MIN)
        return Focus(np.asarray(ahead.result.xfavorite, dtype=np.float64)[:n], scale)

    def _model(self) -> Mapping[str, object]:
        mixture = None if self._strategy is None else gaussian(self._strategy, len(self.space))
        return {"config": plain(self.config), "mixture": mixture}


def gaussian(strategy: Any, n: int) -> dict[str, object]:
    """Return a strategy's distribution as a mixture of one component, as plain values."""
    result = strategy.result
    shape = np.asarray(strategy.sm.covariance_matrix)[:n, :n]
    # The package keeps shape and size apart; the standard deviations have both.
    scale = np.asarray(result.stds)[:n] / np.sqrt(np.diag(shape))
    return {
        "weights": [1.0],
        "means": [np.asarray(result.xfavorite)[:n].tolist()],
        "covariances": [(shape * np.outer(scale, scale)).tolist()],
    }
