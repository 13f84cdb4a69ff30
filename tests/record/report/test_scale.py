"""Axes: where values lie, and ticks that lie on them."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from shearline.record.report.scale import Scale, holding

FINITE = st.floats(-1e9, 1e9)
POSITIVE = st.floats(1e-6, 1e6)


@given(values=st.lists(FINITE, min_size=1), zero=st.booleans(), log=st.booleans())
def test_an_axis_holds_all_its_values_in_order(
    values: list[float], *, zero: bool, log: bool
) -> None:
    scale = holding(values, zero=zero, log=log)
    shares = scale.place(np.sort(values))
    assert scale.low < scale.high
    assert np.all((shares >= 0.0) & (shares <= 1.0))
    assert np.all(np.diff(shares) >= 0.0)
    assert scale.low <= min(values)
    assert max(values) <= scale.high


@given(FINITE, st.floats(1e-3, 1e9), st.integers(1, 12))
def test_ticks_are_round_few_and_on_the_axis(low: float, span: float, about: int) -> None:
    assume(span > abs(low) * 1e-6)
    scale = Scale(low, low + span)
    ticks = scale.ticks(about)
    assert len(ticks) <= about + 1
    assert all(low - span * 1e-6 <= tick <= low + span * (1 + 1e-6) for tick in ticks)
    if len(ticks) > 1:
        step = ticks[1] - ticks[0]
        digits = step / 10.0 ** math.floor(math.log10(step) + 1e-9)
        assert min(abs(digits - nice) for nice in (1.0, 2.0, 5.0)) < 1e-3


@given(st.lists(POSITIVE, min_size=2, unique=True), st.integers(3, 8))
def test_a_logarithmic_axis_has_equal_steps_for_equal_factors(
    values: list[float], about: int
) -> None:
    scale = holding(values, log=True)
    assume(scale.log)
    low, high = scale.low, scale.high
    assert scale.place(math.sqrt(low * high)) == pytest.approx(0.5)
    ticks = scale.ticks(about)
    assert all(low <= tick <= high for tick in ticks)
    assert len(ticks) <= about + 2


def test_costs_that_spread_over_decades_are_shown_logarithmic_and_others_are_not() -> None:
    assert holding([0.3, 0.5, 15.0], log=True).log
    assert not holding([4.0, 5.0, 15.0], log=True).log
    assert not holding([0.0, 0.5, 15.0], log=True).log
    assert not holding([0.3, 0.5, 15.0]).log


@pytest.mark.parametrize("values", [[], [math.nan], [3.0], [0.0, 0.0]])
def test_even_nothing_and_one_value_have_an_axis(values: list[float]) -> None:
    scale = holding(values, zero=True)
    assert scale.low < scale.high
    assert len(scale.ticks(4)) > 1
