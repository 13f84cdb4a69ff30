from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.ledger import Trials
from shearline.learner.ranked.elite import elite_size, fit_elite, rank_weights
from shearline.learner.ranked.score import failure_price, score
from shearline.learner.ranked.window import window

SEEDS = st.integers(0, 2**32 - 1)
COUNTS = st.integers(1, 200)


@given(COUNTS)
def test_weights_fall_with_the_rank_and_sum_to_one(count: int) -> None:
    weights = rank_weights(count)
    assert np.all(weights > 0.0)
    assert np.all(np.diff(weights) < 0.0)
    np.testing.assert_allclose(weights.sum(), 1.0)


@given(COUNTS, COUNTS, COUNTS)
def test_an_elite_is_some_of_the_successes_and_says_something_about_each_parameter(
    length: int, n: int, wins: int
) -> None:
    size = elite_size(length, n, wins)
    assert 1 <= size <= wins
    assert size == wins or size >= max(length // 2, n // 2)


@given(SEEDS, st.integers(1, 30), st.integers(1, 8), st.floats(0.01, 3.0))
def test_draws_stay_in_the_cube_however_few_the_samples(
    seed: int, count: int, n: int, spread: float
) -> None:
    rng = np.random.default_rng(seed)
    draws = fit_elite(rng.random((count, n)), spread).draw(rng, 50)
    assert draws.shape == (50, n)
    assert np.all((draws >= 0.0) & (draws <= 1.0))


@given(SEEDS, st.integers(1, 30), st.integers(1, 8), st.floats(0.0, 0.5))
def test_an_elite_grows_to_a_least_spread_in_all_directions_alike_and_never_shrinks(
    seed: int, count: int, n: int, least: float
) -> None:
    before = fit_elite(np.random.default_rng(seed).random((count, n)), 1.0)
    after = before.at_least(least)
    grown = after.deviation / before.deviation
    np.testing.assert_allclose(grown, grown[0])
    assert grown[0] >= 1.0
    assert np.exp(np.mean(np.log(after.deviation))) >= least * (1.0 - 1e-9)


@given(SEEDS, st.integers(1, 30), st.integers(1, 8))
def test_an_elite_that_moves_keeps_its_spread_and_ends_among_what_it_moved_to(
    seed: int, count: int, n: int
) -> None:
    rng = np.random.default_rng(seed)
    before, best = fit_elite(rng.random((9, n)), 1.0), rng.random((count, n))
    after = before.moved(best)
    np.testing.assert_array_equal(after.factor, before.factor)
    assert np.all(after.centre >= best.min(axis=0) - 1e-12)
    assert np.all(after.centre <= best.max(axis=0) + 1e-12)


@given(SEEDS, st.floats(0.0, 1e6), st.floats(1e-3, 1e3))
def test_less_reliable_or_dearer_is_worse_in_any_unit(seed: int, zero: float, unit: float) -> None:
    rng = np.random.default_rng(seed)
    cost, p = np.sort(rng.random(9)), rng.random(9)
    assert np.all(np.diff(score(cost, np.full(9, 0.7), 3.0)) >= 0.0)
    assert np.all(np.diff(score(np.ones(9), np.sort(p), 3.0)) <= 0.0)
    np.testing.assert_allclose(
        score(unit * cost + zero, p, unit * 3.0), unit * score(cost, p, 3.0) + zero, rtol=1e-9
    )


@given(st.floats(-100.0, 100.0))
def test_a_failure_is_dear_even_where_the_task_charges_nothing_for_it(charged: float) -> None:
    won = np.array([1.0, 2.0, 3.0])
    trials = Trials(
        np.arange(4),
        np.zeros((4, 1)),
        np.append(won, charged),
        np.array([True, True, True, False]),
    )
    assert failure_price(trials, trials.where(trials.success)) >= 10.0


@given(SEEDS, st.integers(2, 60), st.integers(0, 100))
def test_a_window_is_bounded_ordered_and_holds_the_latest_and_the_nearest(
    seed: int, count: int, m: int
) -> None:
    rng = np.random.default_rng(seed)
    trials = Trials(np.arange(m), rng.random((m, 2)), np.zeros(m), np.ones(m, dtype=np.bool_))
    kept = window(trials, np.full(2, 0.5), np.ones(2), count)
    assert len(kept) == min(m, count)
    assert np.all(np.diff(kept.number) > 0)
    assert set(range(max(0, m - count // 2), m)) <= set(kept.number.tolist())
    if m:
        distance = np.linalg.norm(trials.u - 0.5, axis=1)
        assert int(np.argmin(distance)) in kept.number
