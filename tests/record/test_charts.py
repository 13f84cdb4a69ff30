"""Charts keep peaks, stay inside their frame, and use round scales."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.record.charts import (
    GRID_LINES,
    HEIGHT,
    POINTS_MAX,
    WIDTH,
    bounds,
    chart,
    marks,
    nice_above,
    telling,
)


@given(st.floats(1e-9, 1e12))
def test_a_round_scale_holds_its_value_without_wasting_half(value: float) -> None:
    top = nice_above(value)
    assert value <= top * (1 + 1e-9)
    assert top <= 2.5 * value
    assert float(f"{top:.2g}") == pytest.approx(top)


@given(low=st.floats(-1e6, 1e6), high=st.floats(-1e6, 1e6))
def test_bounds_hold_both_ends_and_zero(low: float, high: float) -> None:
    low, high = min(low, high), max(low, high)
    bottom, top = bounds(low, high)
    assert bottom < top
    assert bottom <= 0.0 <= top
    # a little on the other side of zero may be cut
    assert top >= high * (1 - 1e-9) - 0.051 * max(-low, 0.0)
    assert bottom <= low * (1 - 1e-9) + 0.051 * max(high, 0.0)


@given(samples=st.integers(1, 3000), n=st.integers(2, 200), seed=st.integers(0, 99))
def test_thinning_keeps_the_order_the_end_and_the_size(samples: int, n: int, seed: int) -> None:
    values = np.random.default_rng(seed).standard_normal((2, samples)).astype(np.float32)
    kept = telling(list(values), n)
    assert len(kept) <= n
    assert np.all(np.diff(kept) > 0)
    assert kept[-1] == samples - 1


@given(at=st.integers(0, 4999), series=st.integers(0, 2))
def test_a_spike_of_one_sample_survives_thinning(at: int, series: int) -> None:
    values = np.zeros((3, 5000), dtype=np.float32)
    values[:, :] = np.sin(np.arange(5000) / 700.0)
    values[series, at] = 9.0
    assert at in telling(list(values), POINTS_MAX)


def test_a_chart_fills_its_frame() -> None:
    t_s = np.linspace(0.0, 2.0, 1000)
    drawn = chart(t_s, [t_s.astype(np.float32)], 0.0, 2.0, events=[(1.0, "contact")])
    (line,) = drawn.lines
    assert line[0].tolist() == pytest.approx([0.0, HEIGHT])
    assert line[-1].tolist() == pytest.approx([WIDTH, 0.0])
    assert drawn.events[0][0].tolist() == pytest.approx([WIDTH / 2.0, 0.0])
    assert len(marks()) == len(drawn.labels) == 2 * GRID_LINES + 1
    assert drawn.labels[0] == "0"
    assert drawn.labels[-1] == "2 s"


def test_values_outside_or_missing_stay_near_the_frame() -> None:
    values = np.array([np.nan, np.inf, -np.inf, 5.0], dtype=np.float32)
    (line,) = chart(np.arange(4.0), [values], 0.0, 1.0).lines
    assert np.all(np.isfinite(line))
    assert np.all((line[:, 1] > -0.05 * HEIGHT) & (line[:, 1] < 1.05 * HEIGHT))


def test_a_trial_of_one_sample_has_a_chart() -> None:
    drawn = chart(np.zeros(1), [np.zeros(1, np.float32)], 0.0, 1.0)
    assert drawn.lines[0].shape == (1, 2)
