"""Observers are served in measure: at the rate asked for, within budget, and with the scene."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.base import Trace
from shearline.evaluator.showing import SCENE_S, TRACE_BYTES_MAX, Showing, thinned
from shearline.protocol.codec import BULK_BYTES_MAX, encode
from shearline.protocol.messages import Message, TraceData
from shearline.protocol.scene import SceneData

TOKEN = "token-01"


class Sight:
    """A task that knows what it looks like."""

    def scene(self) -> SceneData:
        return SceneData(bodies=[])


def a_trace(samples: int, hz: float = 1000.0, columns: int = 2) -> Trace:
    t_s = (np.arange(samples) / hz).astype(np.float32)
    return Trace(
        t_s=t_s,
        columns={f"c.{i}": ("N", np.arange(samples, dtype=np.float32)) for i in range(columns)},
        events=((0.0, "contact"),),
    )


def kinds(messages: list[Message]) -> list[type[Message]]:
    return [type(message) for message in messages]


def test_a_thousand_samples_a_second_are_shown_as_they_are() -> None:
    trace = a_trace(7115)
    assert thinned(trace, 1000.0, TRACE_BYTES_MAX) is trace


@given(
    samples=st.integers(2, 4000),
    hz=st.floats(10.0, 5000.0),
    asked_hz=st.floats(1.0, 5000.0),
)
def test_no_more_samples_than_asked_for_evenly_spaced_from_the_first(
    samples: int, hz: float, asked_hz: float
) -> None:
    thin = thinned(a_trace(samples, hz), asked_hz, TRACE_BYTES_MAX)
    steps = np.diff(thin.columns["c.0"][1])
    assert thin.columns["c.0"][1][0] == 0.0
    assert np.all(steps == steps[:1])
    if thin.t_s.size > 1:
        assert (thin.t_s.size - 1) / float(thin.t_s[-1]) <= asked_hz * 1.01
    assert thin.events == ((0.0, "contact"),)


def test_a_trace_too_large_for_one_message_is_thinned_until_it_fits() -> None:
    thin = thinned(a_trace(90_000, columns=51), 1000.0, TRACE_BYTES_MAX)
    assert 15_000 < thin.t_s.size < 90_000
    (shown,) = Showing().messages(object(), a_trace(90_000, columns=51), 1, TOKEN, 0.0)
    assert len(encode(shown)) <= BULK_BYTES_MAX


def test_a_budget_of_bytes_a_second_is_kept_and_what_is_missed_is_said(
    caplog: pytest.LogCaptureFixture,
) -> None:
    trace = a_trace(5000, columns=51)
    size = 5000 * 52 * 4
    showing = Showing(bytes_per_s=2.0 * size)
    shown = sum(len(showing.messages(object(), trace, n, TOKEN, now_s=0.1 * n)) for n in range(100))
    # ten seconds of two each, and the burst that one full message makes room for
    assert 20 <= shown <= 20 + BULK_BYTES_MAX // size + 1
    assert "1 traces not shown" in caplog.text


def test_the_scene_is_said_first_and_again_for_those_who_come_later() -> None:
    showing, trace = Showing(), a_trace(10)
    assert kinds(showing.messages(Sight(), trace, 0, TOKEN, 0.0)) == [SceneData, TraceData]
    assert kinds(showing.messages(Sight(), trace, 1, TOKEN, 1.0)) == [TraceData]
    again = showing.messages(Sight(), trace, 2, TOKEN, SCENE_S + 1.0)
    assert kinds(again) == [SceneData, TraceData]


def test_a_task_without_looks_shows_its_traces_only() -> None:
    assert kinds(Showing().messages(object(), a_trace(1), 0, TOKEN, 0.0)) == [TraceData]
