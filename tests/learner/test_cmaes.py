"""CMA-ES as the package has it: the package alone is the oracle."""

from __future__ import annotations

from collections.abc import Callable

import cma  # type: ignore[import-untyped]  # it ships no type information
import numpy as np
import pytest

from shearline.learner import Learner, Space, create
from shearline.learner.base import Array
from shearline.learner.threads import fitting
from shearline.sims.functions import shifted, sphere
from shearline.studies.benchmark import benchmark

BATCH = 12
Cost = Callable[[Array], float]


def bowl(u: Array) -> float:
    return float(np.sum((u - 0.7) ** 2))


def alone(
    n: int, seed: int, cost: Cost, batches: int, size: int = BATCH, **options: object
) -> list[Array]:
    """Run the package by itself and return its generations ``(size, n)``."""
    rngs = iter([np.random.default_rng([seed, k]) for k in range(batches)])
    rng = next(rngs)
    strategy = cma.CMAEvolutionStrategy(
        n * [0.5],
        0.2,
        {
            "bounds": [0.0, 1.0],
            "randn": lambda *shape: rng.standard_normal(shape),
            "seed": np.nan,
            "verbose": -9,
            **options,
        },
    )
    asked = []
    with fitting("cma"):
        for k in range(batches):
            if k:
                rng = next(rngs)
            solutions = strategy.ask(size)
            strategy.tell(solutions, [cost(x) for x in solutions])
            asked.append(np.array(solutions))
    return asked


def batch(learner: Learner, cost: Cost) -> Array:
    proposals = learner.ask(learner.episode_length)
    for p in proposals:
        learner.tell(p.trial, cost=cost(p.theta), success=True)
    return np.array([p.theta for p in proposals])


@pytest.mark.parametrize("n", [2, 5])
def test_with_one_generation_an_episode_it_is_the_package_bit_for_bit(n: int) -> None:
    learner = create("cmaes", Space.unit(n), BATCH, seed=3, population="episode")
    for expected in alone(n, 3, bowl, 8, popsize=BATCH):
        np.testing.assert_array_equal(batch(learner, bowl), expected)


@pytest.mark.filterwarnings("ignore:.*number of solutions passed to `tell`")
@pytest.mark.parametrize("size", [12, 40])
def test_in_batches_it_is_the_package_asked_for_as_many_bit_for_bit(size: int) -> None:
    """In 20 dimensions 12 is the package's own population, so that this is its plain use."""
    problem = shifted(sphere, 20, 1)

    def cost(u: Array) -> float:
        return float(problem.cost(problem.space.denormalise(u)))

    learner = create("cmaes", Space.unit(20), size, seed=3)
    found = np.concatenate([batch(learner, cost) for _ in range(10)])
    np.testing.assert_array_equal(found, np.concatenate(alone(20, 3, cost, 10, size)))


@pytest.mark.parametrize("population", ["package", "episode"])
@pytest.mark.parametrize("n", [1, 2, 5])
def test_it_goes_on_converging(n: int, population: str) -> None:
    """Told in several generations an episode, it would come to rest elsewhere."""
    learner = create("cmaes", Space.unit(n), 40, seed=0, population=population)
    for _ in range(40):
        tried = batch(learner, bowl)
    assert np.mean([bowl(u) for u in tried]) < 1e-4


def test_with_the_penalty_handler_too() -> None:
    learner = create("cmaes", Space.unit(3), BATCH, 3, population="episode", boundary="penalty")
    for expected in alone(3, 3, bowl, 6, popsize=BATCH, BoundaryHandler=cma.BoundPenalty):
        np.testing.assert_array_equal(batch(learner, bowl), expected)


@pytest.mark.parametrize(("start", "spread"), [(0.5, 0.05), (0.1, 0.02)])
def test_it_starts_where_it_is_told_to(start: float, spread: float) -> None:
    learner = create("cmaes", Space.box(4, -5.0, 5.0), 200, seed=0, start=start, spread=spread)
    first = np.array([p.theta for p in learner.ask(200)])
    assert first.mean(axis=0) == pytest.approx(10.0 * start - 5.0, abs=2.5 * spread)
    assert first.std(axis=0) == pytest.approx(10.0 * spread, rel=0.2)


def test_an_episode_with_some_missing_still_teaches() -> None:
    learner = create("cmaes", Space.unit(4), BATCH, seed=0)
    for _ in range(15):
        for p in learner.ask(BATCH):
            if p.trial % 4:
                learner.tell(p.trial, cost=bowl(p.theta), success=True)
    assert learner.recommend().theta == pytest.approx(0.7, abs=0.1)


def test_too_few_outcomes_wait_for_more() -> None:
    learner = create("cmaes", Space.unit(4), 1, seed=0)
    before = learner.snapshot()["mixture"]
    means = []
    for _ in range(8):
        [p] = learner.ask(1)
        learner.tell(p.trial, cost=bowl(p.theta), success=True)
        mixture = learner.snapshot()["mixture"]
        assert isinstance(mixture, dict)
        means.append(mixture["means"])
    assert before is None
    assert means[0] == means[3]
    assert means[0] != means[-1]


def test_a_late_outcome_is_told_once_and_moves_the_search() -> None:
    on_time, late = (create("cmaes", Space.unit(3), BATCH, seed=1) for _ in range(2))
    for learner in (on_time, late):
        first = learner.ask(BATCH)
        for p in first:
            if p.trial:
                learner.tell(p.trial, cost=bowl(p.theta), success=True)
        batch(learner, bowl)
    late.tell(0, cost=0.0, success=True)
    assert not np.array_equal(batch(on_time, bowl), batch(late, bowl))
    for _ in range(10):
        batch(late, bowl)
    assert late.recommend().theta == pytest.approx(0.7, abs=0.1)


def test_what_is_recommended_is_where_the_next_episode_would_be_drawn() -> None:
    learner = create("cmaes", Space.unit(3), BATCH, seed=1)
    for _ in range(4):
        batch(learner, bowl)
    answer = learner.recommend().theta
    learner.ask(1)
    mixture = learner.snapshot()["mixture"]
    assert isinstance(mixture, dict)
    np.testing.assert_allclose(answer, mixture["means"][0], atol=1e-12)


def test_failures_rank_behind_every_success() -> None:
    """Half of the box fails at no cost; the search stays in the other half."""
    learner = create("cmaes", Space.unit(3), BATCH, seed=2)
    for _ in range(20):
        for p in learner.ask(BATCH):
            won = p.theta[0] < 0.5
            learner.tell(p.trial, cost=2.0 - p.theta[0] if won else 0.0, success=bool(won))
    tried = np.array([p.theta[0] for p in learner.ask(BATCH)])
    assert np.mean(tried < 0.5) > 0.5
    assert learner.recommend().theta[0] > 0.3


def test_a_snapshot_has_the_distribution() -> None:
    learner = create("cmaes", Space.unit(4), 400, seed=0, spread=0.05)
    first = np.array([p.theta for p in learner.ask(400)])
    mixture = learner.snapshot()["mixture"]
    assert isinstance(mixture, dict)
    np.testing.assert_allclose(mixture["means"][0], 0.5)
    np.testing.assert_allclose(np.sqrt(np.diag(mixture["covariances"][0])), 0.05, rtol=1e-3)
    assert first.std(axis=0) == pytest.approx(0.05, rel=0.15)


@pytest.mark.slow
def test_the_shifted_sphere_is_reached_as_far_as_documented() -> None:
    [row] = benchmark(["cmaes"], lambda seed: shifted(sphere, 20, seed))
    assert row.best <= 20.0
