"""The pulse: its percentiles against numpy's, its rate against a division."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.run.pulse import BINS, GROWTH, SHORTEST_S, Durations, Pulse


def test_a_pulse_tells_the_rate_of_late() -> None:
    pulse = Pulse()
    assert pulse.rate_hz(0, 10.0) == 0.0
    assert pulse.rate_hz(50, 15.0) == pytest.approx(10.0)


def test_steps_are_kept_apart_by_wall_and_processor() -> None:
    pulse = Pulse()
    pulse.step(wall_s=2.0, cpu_s=0.5)
    assert (pulse.wall.longest_s, pulse.cpu.longest_s) == (2.0, 0.5)


def test_of_nothing_every_percentile_is_zero() -> None:
    assert Durations().percentile_s(0.99) == 0.0


@given(
    st.lists(st.floats(SHORTEST_S, 99.0), min_size=1, max_size=200),
    st.floats(0.01, 1.0),
)
def test_a_percentile_is_right_within_a_bin(took_s: list[float], share: float) -> None:
    durations = Durations()
    for one_s in took_s:
        durations.note(one_s)
    exact_s = float(np.quantile(took_s, share, method="inverted_cdf"))
    told_s = durations.percentile_s(share)
    assert exact_s * (1 - 1e-9) <= told_s <= exact_s * GROWTH * (1 + 1e-9)
    assert durations.longest_s == max(took_s)


@pytest.mark.parametrize("took_s", [0.0, 1e-9, 500.0])
def test_what_no_bin_is_for_is_counted_too(took_s: float) -> None:
    durations = Durations()
    durations.note(took_s)
    assert durations.percentile_s(0.99) == took_s
    assert took_s < SHORTEST_S or took_s > SHORTEST_S * GROWTH ** (BINS - 1) > 90.0
