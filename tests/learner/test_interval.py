from __future__ import annotations

from math import comb, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.interval import clopper_pearson_low, wilson


@given(count=st.integers(1, 80), data=st.data())
def test_the_bound_is_where_what_was_seen_has_a_chance_of_one_in_twenty(
    count: int, data: st.DataObject
) -> None:
    wins = data.draw(st.integers(1, count))
    low = clopper_pearson_low(wins, count)
    tail = sum(comb(count, k) * low**k * (1 - low) ** (count - k) for k in range(wins, count + 1))
    assert tail == pytest.approx(0.05, rel=1e-6)


def test_sixty_of_sixty_support_a_claim_of_95_percent_and_nothing_supports_none() -> None:
    assert clopper_pearson_low(60, 60) == pytest.approx(0.9513, abs=1e-4)
    assert clopper_pearson_low(0, 60) == 0.0
    assert clopper_pearson_low(0, 0) == 0.0


@given(count=st.integers(1, 500), data=st.data())
def test_the_ends_of_an_interval_lie_two_standard_errors_from_what_was_seen(
    count: int, data: st.DataObject
) -> None:
    wins = data.draw(st.integers(0, count))
    low, high = wilson(wins, count)
    assert 0.0 <= low <= wins / count <= high <= 1.0
    for end in (low, high):
        if 0.0 < end < 1.0:
            steps = abs(wins / count - end) / sqrt(end * (1 - end) / count)
            assert steps == pytest.approx(1.959964, rel=1e-4)


def test_an_interval_of_a_hundred_successes_is_as_in_the_tables() -> None:
    low, high = wilson(100, 100)
    assert low == pytest.approx(0.9630, abs=1e-4)
    assert high == 1.0
    assert wilson(0, 0) == (0.0, 1.0)


@given(count=st.integers(1, 60), data=st.data())
def test_a_wider_confidence_makes_a_wider_interval(count: int, data: st.DataObject) -> None:
    wins = data.draw(st.integers(0, count))
    narrow, wide = wilson(wins, count, 0.9), wilson(wins, count, 0.99)
    assert wide[0] <= narrow[0] <= narrow[1] <= wide[1]
