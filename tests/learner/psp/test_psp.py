"""PSP as a whole: the stages of algorithm 1 in their order, and what it finds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from shearline.learner import Space, create
from shearline.learner.base import Array, Learner
from shearline.learner.ledger import Trials
from shearline.learner.psp.config import PSPConfig
from shearline.learner.psp.model import mixture_samples, window
from shearline.sims.functions import fragile_ridge, shifted, sphere, two_peaks_narrow
from shearline.studies.benchmark import benchmark, run_learner

EPISODE = 20
Verdict = Callable[[Array], tuple[float, bool]]


def episode(learner: Learner, verdict: Verdict) -> Array:
    proposals = learner.ask(EPISODE)
    for p in proposals:
        cost, success = verdict(p.theta)
        learner.tell(p.trial, cost=cost, success=success)
    return np.array([p.theta for p in proposals])


def corner(theta: Array) -> tuple[float, bool]:
    """Cost falls towards the origin; the far half fails."""
    return float(np.sum(theta)), bool(np.mean(theta) < 0.5)


def shot(learner: Learner) -> dict[str, Any]:
    return dict(learner.snapshot())


@pytest.mark.parametrize("name", ["psp", "psp-paper"])
def test_the_first_episode_is_a_latin_hypercube(name: str) -> None:
    learner = create(name, Space.unit(4), EPISODE, seed=2)
    strata = np.sort(np.floor(episode(learner, corner) * EPISODE).astype(int), axis=0)
    np.testing.assert_array_equal(strata, np.tile(np.arange(EPISODE)[:, None], (1, 4)))
    assert shot(learner)["proposal"] == "lhs"
    assert shot(learner)["mean_reward"] == 0.0


@pytest.mark.parametrize("name", ["psp", "psp-paper"])
def test_proposals_stay_uniform_and_unfiltered_below_the_minimum_of_successes(name: str) -> None:
    learner = create(name, Space.unit(4), EPISODE, seed=2, proposal_min=5, filter_min=5)
    wins = iter([True] * 4 + [False] * 1000)
    for _ in range(10):
        episode(learner, lambda _: (1.0, next(wins)))
    later = np.concatenate([episode(learner, lambda _: (1.0, False)) for _ in range(10)])
    assert shot(learner)["proposal"] == "uniform"
    assert shot(learner)["partition"] is None
    assert later.mean(axis=0) == pytest.approx(0.5, abs=0.1)
    assert later.std(axis=0) == pytest.approx(np.sqrt(1 / 12), abs=0.06)


def test_the_two_minima_are_separate() -> None:
    learner = create("psp", Space.unit(2), EPISODE, seed=2, proposal_min=1000, filter_min=3)
    episode(learner, corner)
    episode(learner, corner)
    assert shot(learner)["proposal"] == "uniform"
    assert shot(learner)["partition"] is not None


def decision(model: dict[str, Any], u: Array) -> Array:
    part = model["partition"]
    squares = np.sum((u[:, None] - np.array(part["support"])) ** 2, axis=2)
    values: Array = np.exp(-part["gamma"] * squares) @ np.array(part["dual"]) + part["intercept"]
    return values


@pytest.mark.parametrize("name", ["psp", "psp-paper"])
def test_what_is_proposed_has_passed_the_filter(name: str) -> None:
    learner = create(name, Space.unit(2), EPISODE, seed=3, redraws_max=20_000)
    for k in range(5):
        tried = episode(learner, corner)
        if k:
            assert np.all(decision(shot(learner), tried) >= -1e-9)


def filtered_from_uniform(exhausted: str) -> tuple[Array, Array]:
    """Return tuples and decision values of an episode with few redraws of a wide proposal."""
    learner = create(
        "psp", Space.unit(4), EPISODE, 3, redraws_max=3, exhausted=exhausted, proposal_min=10**6
    )
    for _ in range(3):
        episode(learner, corner)
    tried = episode(learner, corner)
    return tried, decision(shot(learner), tried)


@pytest.mark.parametrize("exhausted", ["last", "best"])
def test_after_the_last_redraw_a_rejected_proposal_is_applied(exhausted: str) -> None:
    tried, values = filtered_from_uniform(exhausted)
    assert tried.shape == (EPISODE, 4)
    assert np.any(values < 0.0)
    assert np.any(values >= 0.0)


def test_the_best_of_rejected_proposals_is_better_than_the_last() -> None:
    last, best = filtered_from_uniform("last")[1], filtered_from_uniform("best")[1]
    assert best[best < 0.0].mean() > last[last < 0.0].mean()


@pytest.mark.parametrize("name", ["psp", "psp-paper"])
def test_the_threshold_falls_from_episode_to_episode_where_nothing_fails(name: str) -> None:
    learner = create(name, Space.unit(3), EPISODE, seed=4)
    thresholds = []
    for _ in range(6):
        episode(learner, lambda theta: (float(np.sum(theta)), True))
        learner.ask(EPISODE)
        thresholds.append(shot(learner)["threshold_cost"])
    assert thresholds == sorted(thresholds, reverse=True)


def test_the_component_count_is_chosen_once() -> None:
    learner = create("psp", Space.unit(2), EPISODE, seed=0)
    counts = []
    for _ in range(6):
        episode(learner, lambda xy: (2.0 - float(two_peaks_narrow(xy)), True))
        mixture = shot(learner)["mixture"]
        counts.append(len(mixture["weights"]) if mixture else None)
    assert counts[0] is None
    assert len(set(counts[1:])) == 1


def test_with_a_high_c_both_peaks_of_the_papers_picture_are_kept() -> None:
    found = 0
    for seed in range(5):
        learner = create("psp", Space.unit(2), EPISODE, seed, svm_c=1e3)
        for _ in range(4):
            tried = episode(learner, lambda xy: (2.0 - float(two_peaks_narrow(xy)), True))
        near = [np.linalg.norm(tried - at, axis=1) < 0.15 for at in (0.25, 0.75)]
        found += bool(near[0].any() and near[1].any())
    assert found >= 3


def test_a_late_outcome_is_used_by_the_next_update() -> None:
    learner = create("psp", Space.unit(2), EPISODE, seed=0)
    late, *rest = learner.ask(EPISODE)
    for p in rest:
        cost, success = corner(p.theta)
        learner.tell(p.trial, cost=cost, success=success)
    learner.ask(1)
    assert 0 not in shot(learner)["samples"]["trial"]
    learner.tell(late.trial, cost=0.1, success=True)
    learner.ask(EPISODE)
    assert 0 in shot(learner)["samples"]["trial"]


def test_an_update_looks_at_a_bounded_number_of_trials() -> None:
    learner = create("psp", Space.unit(2), EPISODE, seed=0, fit_samples_max=50)
    for _ in range(8):
        episode(learner, corner)
    assert len(shot(learner)["samples"]["trial"]) == 50


@pytest.mark.parametrize("wins", [0, 3, 60, 97, 100])
def test_the_window_keeps_the_latest_of_both_kinds(wins: int) -> None:
    success = np.zeros(100, dtype=np.bool_)
    success[np.random.default_rng(wins).permutation(100)[:wins]] = True
    kept = window(Trials(np.arange(100), np.zeros((100, 1)), np.zeros(100), success), 20)
    assert len(kept) == 20
    assert int(kept.success.sum()) >= min(10, wins)
    assert int((~kept.success).sum()) >= min(10, 100 - wins)
    for kind in (True, False):
        have = kept.number[kept.success == kind]
        every = np.flatnonzero(success == kind)
        np.testing.assert_array_equal(have, every[len(every) - len(have) :])


def test_few_positives_are_filled_up_with_the_next_cheapest_successes() -> None:
    u = np.arange(6.0)[:, None]
    cost = np.array([3.0, 1.0, 2.0, 0.0, 5.0, 4.0])
    success = np.array([True, True, True, False, True, True])
    good = np.array([False, True, False, False, False, False])
    trials = Trials(np.arange(6), u, cost, success)
    chosen = mixture_samples(trials, good, PSPConfig(proposal_min=3))
    assert sorted(chosen[:, 0].tolist()) == [0.0, 1.0, 2.0]
    every = mixture_samples(trials, good, PSPConfig.paper())
    assert every[:, 0].tolist() == [0.0, 1.0, 2.0, 4.0, 5.0]


def test_it_stays_off_a_cheap_fragile_ridge() -> None:
    late = [
        run_learner("psp", fragile_ridge(), episodes=10, episode_length=20, seed=seed)
        for seed in range(3)
    ]
    assert np.mean([run.success_by_episode[-3:].mean() for run in late]) > 0.85


@pytest.mark.slow
def test_the_shifted_sphere_is_reached_as_far_as_documented() -> None:
    rows = benchmark(["psp", "psp-paper"], lambda seed: shifted(sphere, 20, seed), seeds=range(5))
    assert rows[0].best <= 8.0
    assert rows[1].best <= 30.0
