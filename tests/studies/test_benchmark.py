from __future__ import annotations

import math

import numpy as np
import pytest

from shearline.learner import create
from shearline.sims.functions import fragile_ridge, shifted, sphere
from shearline.studies.benchmark import benchmark, run_learner


def test_a_run_is_what_the_learner_alone_would_have_done() -> None:
    problem = shifted(sphere, 3, seed=1)
    run = run_learner("psp", problem, episodes=3, episode_length=10, seed=4)
    learner = create("psp", problem.space, 10, 4)
    for k in range(3):
        for p in learner.ask(10):
            np.testing.assert_array_equal(p.theta, run.theta[p.trial])
            cost = float(problem.cost(p.theta))
            assert run.cost[p.trial] == cost
            learner.tell(p.trial, cost=cost, success=True)
        assert run.success_by_episode[k] == 1.0
    assert run.best == run.cost.min()


def test_the_same_seed_gives_the_same_run_with_noise_and_another_does_not() -> None:
    runs = [
        run_learner("psp", fragile_ridge(), episodes=2, episode_length=20, seed=s)
        for s in (7, 7, 8)
    ]
    np.testing.assert_array_equal(runs[0].cost, runs[1].cost)
    assert not np.array_equal(runs[0].cost, runs[2].cost)


def test_a_row_is_the_mean_over_its_seeds() -> None:
    rows = benchmark(
        ["random", "lhs"],
        lambda seed: shifted(sphere, 2, seed),
        seeds=(3, 4),
        episodes=2,
        episode_length=5,
    )
    assert [(row.learner, row.problem, row.runs) for row in rows] == [
        ("random", "sphere, shifted", 2),
        ("lhs", "sphere, shifted", 2),
    ]
    best = [
        run_learner("lhs", shifted(sphere, 2, s), episodes=2, episode_length=5, seed=s).best
        for s in (3, 4)
    ]
    assert rows[1].best == np.mean(best)
    assert rows[1].best_se == pytest.approx(abs(best[0] - best[1]) / 2)
    assert rows[1].success_late == 1.0


def test_a_single_run_has_no_standard_error() -> None:
    rows = benchmark(["random"], lambda _: fragile_ridge(), seeds=[0], episodes=1)
    assert math.isnan(rows[0].best_se)
    assert rows[0].success_late < 1.0


def test_switches_reach_the_learner() -> None:
    problem = shifted(sphere, 3, seed=1)
    plain, other = (
        run_learner("psp", problem, episodes=3, episode_length=20, seed=4, switches=switches)
        for switches in ({}, {"labels": "previous"})
    )
    assert not np.array_equal(plain.cost, other.cost)
