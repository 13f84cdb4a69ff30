"""Effort: processor time, whatever of it the wall clock saves asking for."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import pytest

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


def test_a_short_stretch_counts_as_all_computed_without_asking_the_system(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []
    clock = SimpleNamespace(
        perf_counter=iter((10.0, 10.0 + 0.9 * TOLD_APART_S, 10.0 + 0.9 * TOLD_APART_S)).__next__,
        thread_time=lambda: float(len(asked)) if asked.append("asked") is None else 0.0,
    )
    monkeypatch.setattr(effort, "time", clock)
    one = Effort()
    assert one.cpu_s() == pytest.approx(0.9 * TOLD_APART_S)
    assert not one.exceeds(TOLD_APART_S)
    assert asked == ["asked"]
