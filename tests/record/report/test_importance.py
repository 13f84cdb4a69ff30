"""Importance: what decides is found, what merely drifts along is not."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.record.report.facts import Facts
from shearline.record.report.importance import SHUFFLES, Importance, importance, picture, ranked

EPISODES = np.repeat(np.arange(10), 20)


def test_the_parameter_that_decides_comes_first_and_stands_above_chance() -> None:
    rng = np.random.default_rng(1)
    u = rng.random((200, 6))
    cost = (u[:, 4] - 0.4) ** 2 + 0.01 * rng.standard_normal(200)
    found = importance(u, ranked(cost, np.ones(200, dtype=bool)), EPISODES)
    assert found is not None
    assert found.order()[0] == 4
    assert found.explained[4] > 0.6
    assert np.all(found.chance < 0.1)
    assert np.sum(found.explained > found.chance) <= 2


def test_what_drifts_with_the_learners_progress_does_not_seem_to_matter() -> None:
    rng = np.random.default_rng(2)
    drift = EPISODES[:, None] / 10.0
    u = drift + 0.05 * rng.standard_normal((200, 20))
    cost = 10.0 - EPISODES + rng.random(200)
    plain = np.corrcoef(u[:, 0], cost)[0, 1] ** 2
    found = importance(u, ranked(cost, np.ones(200, dtype=bool)), EPISODES)
    assert found is not None
    assert plain > 0.8
    assert found.explained.max() < 0.12


def test_episodes_that_hardly_vary_anything_do_not_drown_those_that_do() -> None:
    rng = np.random.default_rng(6)
    spread = 0.8 ** EPISODES[:, None]
    u = 0.5 + 0.3 * spread * rng.standard_normal((200, 8))
    cost = 100.0 * (u[:, 3] - 0.2) + 1.0 * rng.standard_normal(200)
    narrow = spread[:, 0] < 0.2
    cost[narrow] = rng.random(int(narrow.sum()))
    found = importance(u, ranked(cost, np.ones(200, dtype=bool)), EPISODES)
    assert found is not None
    assert found.order()[0] == 3
    assert found.explained[3] > 0.6


def test_chance_is_beaten_about_once_in_twenty() -> None:
    rng = np.random.default_rng(3)
    u, ranks = rng.random((200, 200)), rng.permutation(200).astype(float)
    found = importance(u, ranks, EPISODES)
    assert found is not None
    assert 0.01 < np.mean(found.explained > found.chance) < 0.12
    assert SHUFFLES >= 100


def test_shares_are_shares_and_do_not_depend_on_the_scale_or_the_order_of_trials() -> None:
    rng = np.random.default_rng(4)
    u, ranks = rng.random((200, 4)), rng.random(200)
    one = importance(u, ranks, EPISODES)
    order = rng.permutation(200)
    other = importance(u[order], 3.0 * ranks[order] + 1.0, EPISODES[order])
    assert one is not None
    assert other is not None
    np.testing.assert_allclose(one.explained, other.explained)
    assert np.all((one.explained >= 0.0) & (one.explained <= 1.0))


@pytest.mark.parametrize(
    ("trials", "ranks", "episodes"),
    [
        (5, np.arange(5.0), np.zeros(5, dtype=int)),
        (40, np.ones(40), np.zeros(40, dtype=int)),
        (40, np.arange(40.0), np.arange(40)),
        (0, np.zeros(0), np.zeros(0, dtype=int)),
    ],
    ids=["too few", "all alike", "one in each episode", "none"],
)
def test_nothing_is_said_where_nothing_can_be_told(
    trials: int, ranks: np.ndarray, episodes: np.ndarray
) -> None:
    assert importance(np.random.default_rng(0).random((trials, 2)), ranks, episodes) is None


def test_a_parameter_that_never_changes_explains_nothing() -> None:
    rng = np.random.default_rng(5)
    u = np.stack([np.full(200, 0.3), rng.random(200)], axis=1)
    found = importance(u, rng.random(200), EPISODES)
    assert found is not None
    assert found.explained[0] == pytest.approx(0.0)


@given(
    st.lists(
        st.tuples(st.floats(0, 3).map(lambda c: round(c, 1)), st.booleans()),
        min_size=1,
        max_size=30,
    )
)
def test_ranks_put_successes_by_cost_before_failures_by_cost(
    trials: list[tuple[float, bool]],
) -> None:
    cost = np.array([c for c, _ in trials])
    success = np.array([s for _, s in trials])
    ranks = ranked(cost, success)
    for i, (c, s) in enumerate(trials):
        better = sum((not q, d) < (not s, c) for d, q in trials)
        alike = sum((d, q) == (c, s) for d, q in trials)
        assert ranks[i] == better + (alike - 1) / 2


def test_the_picture_has_a_bar_for_each_parameter(facts: Facts, see: Callable[..., Any]) -> None:
    found = Importance(np.array([0.1, 0.5, 0.0, 0.2, 0.3]), np.full(5, 0.15))
    page = see(picture(facts, found))
    assert page.count("fill") == 5
    assert page.count("weak") == 2
    assert page.text.index("ins_speed") < page.text.index("ins_k_rot") < page.text.index("ins_push")
    assert "too much alike" in see(picture(facts, None)).text
