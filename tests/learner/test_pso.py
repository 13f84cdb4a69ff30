from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner import Space, create
from shearline.learner.base import Array
from shearline.learner.charge import Failures
from shearline.learner.ledger import Trials
from shearline.learner.pso import Draws, PSOConfig, Walls, best_places, move, pull
from shearline.sims.functions import shifted, sphere
from shearline.studies.benchmark import benchmark

PLACE: Array = np.array([[0.1, 0.2], [0.6, 0.9]])
VELOCITY: Array = np.array([[0.05, 0.0], [0.5, -0.1]])


def told(number: list[int], cost: list[float], success: list[bool] | None = None) -> Trials:
    """Trials in a line: the k-th lies at (.1 k, .1 k)."""
    won = np.ones(len(cost), dtype=np.bool_) if success is None else np.array(success)
    u = np.repeat(np.array(number)[:, None] / 10.0, 2, axis=1)
    return Trials(np.array(number), u, np.array(cost), won)


def test_a_trial_belongs_to_its_particle_however_late() -> None:
    own, swarm = best_places(told([1, 2, 5], [4.0, 9.0, 3.0]), PLACE, Failures.ALIKE)
    np.testing.assert_array_equal(own, [[0.2, 0.2], [0.5, 0.5]])
    np.testing.assert_array_equal(swarm, [[0.5, 0.5], [0.5, 0.5]])


def test_of_equal_places_the_earlier_is_kept() -> None:
    own, swarm = best_places(told([0, 1, 2, 3], [1.0] * 4), PLACE, Failures.ALIKE)
    np.testing.assert_array_equal(own, [[0.0, 0.0], [0.1, 0.1]])
    np.testing.assert_array_equal(swarm, np.zeros((2, 2)))


def test_a_failure_is_nobodys_best_place_unless_failures_are_ordered() -> None:
    trials = told([2, 3], [0.0, 5.0], [False, True])
    own, _ = best_places(trials, PLACE, Failures.ALIKE)
    np.testing.assert_array_equal(own, [PLACE[0], [0.3, 0.3]])
    own, swarm = best_places(trials, PLACE, Failures.ORDERED)
    np.testing.assert_array_equal(own, [[0.2, 0.2], [0.3, 0.3]])
    np.testing.assert_array_equal(swarm[0], [0.3, 0.3])


def test_who_knows_nothing_is_drawn_nowhere() -> None:
    own, swarm = best_places(told([], []), PLACE, Failures.ALIKE)
    moved = pull(PLACE, VELOCITY, own, swarm, np.random.default_rng(0), PSOConfig(inertia=0.5))
    np.testing.assert_array_equal(moved, 0.5 * VELOCITY)


@pytest.mark.parametrize("draws", list(Draws))
def test_the_pull_is_equation_ten(draws: Draws) -> None:
    config = PSOConfig(inertia=0.7, own=1.5, swarm=0.5, draws=draws)
    own, swarm = PLACE + 0.1, PLACE - 0.2
    rng = np.random.default_rng(3)
    columns = 2 if draws is Draws.COORDINATE else 1
    r_1, r_2 = rng.random((2, columns)), rng.random((2, columns))
    expected = 0.7 * VELOCITY + 1.5 * r_1 * 0.1 - 0.5 * r_2 * 0.2
    found = pull(PLACE, VELOCITY, own, swarm, np.random.default_rng(3), config)
    np.testing.assert_allclose(found, expected, atol=1e-15)


@given(
    place=st.lists(st.floats(0, 1), min_size=1, max_size=4),
    step=st.floats(-3, 3, allow_subnormal=False),
)
@pytest.mark.parametrize("walls", list(Walls))
def test_no_particle_leaves_the_box(walls: Walls, place: list[float], step: float) -> None:
    x: Array = np.array([place])
    at, velocity = move(x, np.full_like(x, step), walls)
    assert np.all((at >= 0.0) & (at <= 1.0))
    free = (x + step >= 0.0) & (x + step <= 1.0)
    np.testing.assert_allclose(at[free], (x + step)[free], atol=1e-12)
    stopped = 0.0 if walls is Walls.STOP else step
    assert np.all(velocity[~free] == stopped)
    assert np.all(velocity[free] == step)


def test_the_swarm_begins_uniformly_and_at_rest() -> None:
    learner = create("pso", Space.unit(2), 400, seed=0)
    first = np.array([p.theta for p in learner.ask(400)])
    assert first.mean(axis=0) == pytest.approx(0.5, abs=0.06)
    assert first.std(axis=0) == pytest.approx(np.sqrt(1 / 12), abs=0.03)
    rest = np.array([p.theta for p in learner.ask(400)])
    np.testing.assert_array_equal(rest, first)


def test_a_swarm_with_speed_flies_on_its_own() -> None:
    learner = create("pso", Space.unit(2), 10, seed=0, speed=0.5)
    first, second = learner.ask(10), learner.ask(10)
    assert all(not np.array_equal(a.theta, b.theta) for a, b in zip(first, second, strict=True))


@pytest.mark.slow
def test_the_shifted_sphere_is_reached_as_far_as_documented() -> None:
    [row] = benchmark(["pso"], lambda seed: shifted(sphere, 20, seed))
    assert 38.0 <= row.best <= 55.0
