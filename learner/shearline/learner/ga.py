"""Genetic algorithm, the paper's appendix A.2 with its equations (8) and (9) as printed.

The appendix says how tuples mutate and cross, not who may: selection and survival are switches.
It knows costs and tuples, no model of either.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shearline.learner.base import Array
from shearline.learner.charge import Failures, charged
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.ledger import Trials
from shearline.learner.recommend import ON_POLICY_TRIALS, Focus, elite_focus
from shearline.learner.switches import check, having, plain
from shearline.protocol.space import Space


class Selection(enum.StrEnum):
    """How parents are chosen."""

    TOURNAMENT = "tournament"  # the cheapest of a few drawn at random
    TRUNCATION = "truncation"  # any of the cheaper half
    ROULETTE = "roulette"  # with a chance in proportion to what they cost less than the dearest


class Crossover(enum.StrEnum):
    """Whether equation (9) draws its v once per tuple or for each parameter."""

    TUPLE = "tuple"  # "p_1, p_2 are the two parameter-tuples chosen for crossover"
    PARAMETER = "parameter"


@dataclass(frozen=True, slots=True)
class GAConfig:
    """What appendix A.2 leaves open.

    Attributes:
        selection: How parents are chosen.
        tournament: Tuples that compete in a tournament.
        crossover: What v is drawn for.
        mutation_variance: sigma_x^2 of equation (8), in units of the cube's edge squared.
        mutation_chance: Chance that a child has one of its parameters mutated.
        survivors: Cheapest trials ever that are parents beside the last generation.
        failures: Whether failures differ among themselves.
    """

    selection: Selection = Selection.TOURNAMENT
    tournament: int = 2
    crossover: Crossover = Crossover.TUPLE
    mutation_variance: float = 0.05
    mutation_chance: float = 1.0
    survivors: int = 1
    failures: Failures = Failures.ALIKE

    def __post_init__(self) -> None:
        variance, chance = self.mutation_variance, self.mutation_chance
        check(self.tournament >= 1, "ga", "tournament", "1 or more", self.tournament)
        check(variance >= 0, "ga", "mutation_variance", "0 or more", variance)
        check(0 <= chance <= 1, "ga", "mutation_chance", "0 to 1", chance)
        check(self.survivors >= 0, "ga", "survivors", "0 or more", self.survivors)


class GeneticAlgorithm(EpisodicLearner):
    """One generation an episode; the first is uniform, or descends from another run's trials.

    Args:
        space: What is being learned.
        episode_length: Size of a generation.
        seed: 0 or more.
        switches: Fields of :class:`GAConfig`.
    """

    name = "ga"
    primes = True

    def __init__(
        self, space: Space, episode_length: int = 20, seed: int = 0, **switches: object
    ) -> None:
        super().__init__(space, episode_length, seed)
        self.config = having(GAConfig(), self.name, switches)
        self._parents = np.empty((0, len(space)))
        self._cost = np.empty(0)

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        del episode, rng
        self._parents, self._cost = parents(trials, self.episode_length, self.config)

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        del index
        if not len(self._parents):
            return rng.random(len(self.space))
        first, second = (self._parents[select(self._cost, rng, self.config)] for _ in range(2))
        child = cross(first, second, self._cut(rng))
        if rng.random() < self.config.mutation_chance:
            child = mutate(child, rng, self.config.mutation_variance)
        return child

    def _cut(self, rng: np.random.Generator) -> Array:
        whole = self.config.crossover is Crossover.TUPLE
        return rng.random(1 if whole else len(self.space))

    def _focus(self, trials: Trials) -> Focus:
        """Return the middle of the cheaper half of the successes of the latest generations."""
        return elite_focus(trials.last(ON_POLICY_TRIALS), len(self.space))

    def _model(self) -> Mapping[str, object]:
        population = {"u": self._parents.tolist(), "cost": self._cost.tolist()}
        return {"config": plain(self.config), "population": population}


def parents(trials: Trials, count: int, config: GAConfig) -> tuple[Array, Array]:
    """Return tuples ``(k, n)`` and costs ``(k,)`` of those who may have children, cheapest first.

    They are the latest ``count`` trials that were told, whatever episode they belong to, and the
    cheapest ``config.survivors`` before them.
    """
    cost = charged(trials, config.failures)
    order = np.argsort(cost, kind="stable")
    latest = np.arange(len(trials)) >= len(trials) - count
    survivors = np.flatnonzero(~latest[order])[: config.survivors]
    chosen = latest[order]
    chosen[survivors] = True
    return trials.u[order[chosen]], cost[order[chosen]]


def select(cost: Array, rng: np.random.Generator, config: GAConfig) -> int:
    """Return the index of one parent; costs ``(k,)`` rise."""
    count = len(cost)
    match config.selection:
        case Selection.TOURNAMENT:
            return int(rng.integers(0, count, config.tournament).min())
        case Selection.TRUNCATION:
            return int(rng.integers(0, (count + 1) // 2))
        case Selection.ROULETTE:
            fitness = cost[-1] - cost
            total = float(fitness.sum())
            return int(rng.choice(count, p=fitness / total if total > 0 else None))


def cross(first: Array, second: Array, v: Array) -> Array:
    """Return equation (9): the first parent, the second, or a blend, as v in [0, 1] has it.

    Args:
        first: Parent p_1 ``(n,)``.
        second: Parent p_2 ``(n,)``.
        v: One number ``(1,)``, or one for each parameter ``(n,)``.
    """
    # Below .25 and above .75 the line of the middle case is cut off.
    share = np.clip(2.0 * (v - 0.25), 0.0, 1.0)
    # In this form a share of 1 gives the second parent to the last bit.
    child: Array = (1.0 - share) * first + share * second
    return child


def mutate(u: Array, rng: np.random.Generator, variance: float) -> Array:
    """Return equation (8): a tuple ``(n,)`` with noise on one parameter chosen at random."""
    child = u.copy()
    child[rng.integers(len(u))] += rng.normal(0.0, np.sqrt(variance))
    return np.clip(child, 0.0, 1.0)
