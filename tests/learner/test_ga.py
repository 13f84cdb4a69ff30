from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner import Space, create
from shearline.learner.base import Array
from shearline.learner.ga import GAConfig, Selection, cross, mutate, parents, select
from shearline.learner.ledger import Trials
from shearline.sims.functions import shifted, sphere
from shearline.studies.benchmark import benchmark

SHARE = st.floats(0.0, 1.0)
PAIR = st.lists(st.tuples(SHARE, SHARE), min_size=1, max_size=5)


def line(cost: list[float], success: list[bool] | None = None) -> Trials:
    """Trials whose only coordinate is their number, as a share."""
    count = len(cost)
    won = np.ones(count, dtype=np.bool_) if success is None else np.array(success)
    return Trials(np.arange(count), np.arange(count)[:, None] / 100.0, np.array(cost), won)


@given(pair=PAIR, v=SHARE)
def test_crossover_is_equation_nine(pair: list[tuple[float, float]], v: float) -> None:
    first, second = np.array(pair).T
    child = cross(first, second, np.array([v]))
    if v <= 0.25:
        np.testing.assert_array_equal(child, first)
    elif v >= 0.75:
        np.testing.assert_array_equal(child, second)
    else:
        np.testing.assert_allclose(child, first + 2 * (v - 0.25) * (second - first), atol=1e-15)


def test_mutation_is_equation_eight() -> None:
    rng = np.random.default_rng(0)
    middle = np.full(4, 0.5)
    steps: Array = np.array([mutate(middle, rng, 0.01) - middle for _ in range(4000)])
    assert np.all(np.count_nonzero(steps, axis=1) == 1)
    chosen = np.count_nonzero(steps, axis=0)
    assert chosen.min() > 800
    assert np.var(steps[steps != 0.0]) == pytest.approx(0.01, rel=0.1)
    assert np.all(middle == 0.5)


def test_a_mutant_stays_in_the_box() -> None:
    rng = np.random.default_rng(0)
    mutants = np.array([mutate(np.zeros(2), rng, 4.0) for _ in range(50)])
    assert mutants.min() == 0.0
    assert mutants.max() == 1.0


def test_parents_are_the_latest_generation_and_the_best_before_it() -> None:
    told = line([5.0, 1.0, 2.0, 9.0, 8.0, 7.0])
    u, cost = parents(told, 3, GAConfig())
    assert cost.tolist() == [1.0, 7.0, 8.0, 9.0]
    assert u[:, 0].tolist() == [0.01, 0.05, 0.04, 0.03]
    assert parents(told, 3, GAConfig(survivors=0))[1].tolist() == [7.0, 8.0, 9.0]
    assert len(parents(told, 3, GAConfig(survivors=9))[1]) == 6


def test_a_cheap_failure_comes_last() -> None:
    u, _ = parents(line([0.1, 3.0, 2.0], [False, True, True]), 3, GAConfig())
    assert u[:, 0].tolist() == [0.02, 0.01, 0.0]


@pytest.mark.parametrize("selection", list(Selection))
def test_the_cheap_are_chosen_more_often(selection: Selection) -> None:
    rng = np.random.default_rng(1)
    cost: Array = np.arange(6.0)
    chosen = [select(cost, rng, GAConfig(selection=selection)) for _ in range(3000)]
    count = np.bincount(chosen, minlength=6)
    assert count[:3].sum() > 1.5 * count[3:].sum()
    if selection is Selection.TRUNCATION:
        assert count[3:].sum() == 0
    if selection is Selection.ROULETTE:
        assert count[5] == 0
    if selection is Selection.TOURNAMENT:
        np.testing.assert_allclose(count / 3000, (2 * np.arange(6)[::-1] + 1) / 36, atol=0.04)


@pytest.mark.parametrize("selection", list(Selection))
def test_equal_costs_choose_anyone(selection: Selection) -> None:
    rng = np.random.default_rng(1)
    config = GAConfig(selection=selection)
    assert len({select(np.zeros(4), rng, config) for _ in range(100)}) > 1


def test_without_mutation_children_lie_between_their_parents() -> None:
    learner = create("ga", Space.unit(3), 10, seed=1, mutation_chance=0.0, survivors=0)
    first = learner.ask(10)
    for p in first:
        learner.tell(p.trial, cost=float(p.theta.sum()), success=True)
    tried = np.array([p.theta for p in first])
    children = np.array([p.theta for p in learner.ask(10)])
    assert np.all(children >= tried.min(axis=0))
    assert np.all(children <= tried.max(axis=0))


@pytest.mark.slow
def test_the_shifted_sphere_is_reached_as_far_as_documented() -> None:
    [row] = benchmark(["ga"], lambda seed: shifted(sphere, 20, seed))
    assert 15.0 <= row.best <= 22.0
