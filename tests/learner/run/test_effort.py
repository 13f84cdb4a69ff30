"""Effort: processor time, whatever of it the wall clock saves asking for."""

from __future__ import annotations

import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.run import effort
from shearline.learner.run.effort import TOLD_APART_S, Effort


def _compute(cpu_s: float) -> None:
    end_s = time.thread_time() + cpu_s
    while time.thread_time() < end_s:
        pass


def test_who_computes_exceeds_a_limit_and_is_told_how_much_it_was() -> None:
    one = Effort()
    _compute(4 * TOLD_APART_S)
    assert one.exceeds(2 * TOLD_APART_S)
    assert one.cpu_s() >= 4 * TOLD_APART_S


def test_who_waits_spends_nothing() -> None:
    one = Effort()
    threading.Event().wait(10 * TOLD_APART_S)
    assert not one.exceeds(5 * TOLD_APART_S)
    assert one.cpu_s() < 5 * TOLD_APART_S


class Clock:
    """Stands in for the time module; counts how often the system was asked."""

    def __init__(self) -> None:
        self.wall_s = 10.0
        self.cpu_s = 3.0
        self.asked = 0

    def perf_counter(self) -> float:
        return self.wall_s

    def thread_time(self) -> float:
        self.asked += 1
        return self.cpu_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(effort, "time", clock)
    return clock


def test_a_short_stretch_counts_as_all_computed_without_asking_the_system(clock: Clock) -> None:
    one = Effort()
    clock.wall_s += 0.9 * TOLD_APART_S
    assert one.cpu_s() == pytest.approx(0.9 * TOLD_APART_S)
    assert not one.exceeds(TOLD_APART_S)
    assert clock.asked == 1


@given(
    steps=st.lists(st.tuples(st.floats(0.0, 0.02), st.floats(0.0, 1.0)), max_size=30),
    limit_s=st.floats(0.001, 0.05),
)
def test_a_limit_is_told_exactly_and_the_system_asked_only_when_it_could_be_reached(
    steps: list[tuple[float, float]], limit_s: float
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        clock = Clock()
        patch.setattr(effort, "time", clock)
        one = Effort()
        spent_s = 0.0
        known_s, since_s = 0.0, 0.0
        for wall_s, share in steps:
            clock.wall_s += wall_s
            clock.cpu_s += wall_s * share
            spent_s, since_s = clock.cpu_s - 3.0, since_s + wall_s
            asked = clock.asked
            assert one.exceeds(limit_s) == (spent_s > limit_s)
            if known_s + since_s < limit_s * (1 - 1e-9):
                assert clock.asked == asked
            if clock.asked > asked:
                known_s, since_s = spent_s, 0.0
