"""Phases from events: landmarks and verdicts are not phases, and no time is lost or invented."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.protocol.messages import TraceData
from shearline.record.phases import phases_of


def trace(
    t_s: np.ndarray, events: list[tuple[float, str]], phase: np.ndarray | None = None
) -> TraceData:
    columns = [t_s] if phase is None else [t_s, phase]
    return TraceData(
        trial=0,
        token="token-00",
        samples=t_s.size,
        names=["t_s", "phase"][: len(columns)],
        units=["s", ""][: len(columns)],
        data=np.stack(columns).astype("<f4").tobytes(),
        events=events,
    )


CLOCK = np.arange(0.0, 1.001, 0.001)


def test_a_landmark_within_a_phase_does_not_end_it() -> None:
    column = np.where(CLOCK < 0.2995, 0.0, 1.0)
    events = [(0.0, "approach"), (0.3, "insertion"), (0.31, "mouth"), (1.0, "success")]
    first, second = phases_of(trace(CLOCK, events, column))
    assert (first.name, second.name) == ("approach", "insertion")
    assert first.end_s == second.start_s == 0.3
    assert second.end_s == pytest.approx(1.0)


def test_without_a_phase_column_every_event_begins_one() -> None:
    events = [(0.0, "reach"), (0.4, "press"), (1.0, "success")]
    assert [phase.name for phase in phases_of(trace(CLOCK, events))] == ["reach", "press"]


@pytest.mark.parametrize(
    ("t_s", "events"), [(np.zeros(0), [(0.0, "approach")]), (CLOCK, [])], ids=["samples", "events"]
)
def test_a_trace_without_samples_or_events_has_no_phases(
    t_s: np.ndarray, events: list[tuple[float, str]]
) -> None:
    assert phases_of(trace(t_s, events)) == ()


@given(st.lists(st.integers(1, 999), min_size=1, max_size=6, unique=True))
def test_phases_follow_one_another_from_the_first_event_to_the_end(ticks: list[int]) -> None:
    events = [(tick / 1000.0, f"p{tick}") for tick in sorted(ticks)]
    phases = phases_of(trace(CLOCK, events))
    assert [phase.name for phase in phases] == [name for _, name in events]
    ends = [phase.end_s for phase in phases[:-1]]
    assert ends == [phase.start_s for phase in phases[1:]]
    assert phases[-1].end_s == pytest.approx(1.0)
