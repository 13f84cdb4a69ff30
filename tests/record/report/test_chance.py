"""The interval of a success rate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.record.report.chance import Z_95, wilson

COUNTS = st.integers(1, 5000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))


@given(COUNTS)
def test_an_interval_holds_the_rate_and_stays_between_0_and_1(counts: tuple[int, int]) -> None:
    won, trials = counts
    low, high = wilson(won, trials)
    assert 0.0 <= low <= won / trials <= high <= 1.0


@given(COUNTS)
def test_its_ends_solve_the_score_equation(counts: tuple[int, int]) -> None:
    won, trials = counts
    for end in wilson(won, trials):
        p = float(end)
        if 0.0 < p < 1.0:
            score = abs(won / trials - p) / np.sqrt(p * (1.0 - p) / trials)
            assert score == pytest.approx(Z_95, rel=1e-6)


@given(COUNTS)
def test_failures_mirror_successes(counts: tuple[int, int]) -> None:
    won, trials = counts
    low, high = wilson(won, trials)
    mirrored_low, mirrored_high = wilson(trials - won, trials)
    assert low == pytest.approx(1.0 - mirrored_high)
    assert high == pytest.approx(1.0 - mirrored_low)


def test_without_trials_nothing_is_known() -> None:
    low, high = wilson([0, 3], [0, 4])
    assert (low[0], high[0]) == (0.0, 1.0)
    assert low[1] > 0.0
