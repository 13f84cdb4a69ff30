"""The live table says what the status says, whatever the status."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from shearline.deploy.table import duration, number, render, time_left_s
from shearline.protocol.messages import EpisodeClosed, EvaluatorState, Status


def status(**changes: object) -> Status:
    fields: dict[str, object] = {
        "run": "demo", "task": "keylock", "learner": "psp", "epoch": 1, "state": "running",
        "episode": 1, "episodes": 10, "trials_per_episode": 20, "pending": 3, "leased": 2,
        "done": 15, "counted": 35, "lost": 0, "late": 0, "duplicates": 0, "aborted": 0,
        "rejected": 0, "rate_hz": 2.0, "step_ms_max": 1.0, "evaluators": [], "history": [],
        "at_s": 0.0,
    }  # fmt: skip
    return Status(**(fields | changes))  # type: ignore[arg-type]  # fields are named above


def drawn(one: Status) -> str:
    console = Console(width=120, record=True, file=open("/dev/null", "w"))  # noqa: SIM115, PTH123
    with console.file:
        console.print(render(one))
        return console.export_text()


def test_counts_rate_and_time_left_are_shown() -> None:
    text = drawn(status())
    assert "35 of 200 trials counted" in text
    assert "2.00 trials/s" in text
    assert "at most 7.5 ms of processor time" in drawn(status(step_cpu_ms_max=7.5))
    assert "1:22 left" in text


def test_losses_are_shown_only_when_there_are_some() -> None:
    assert "lost" not in drawn(status()).splitlines()[0]
    assert "2 lost, 1 duplicates" in drawn(status(lost=2, duplicates=1)).splitlines()[0]
    assert "3 malformed, 4 dropped" in drawn(status(malformed=3, dropped=4)).splitlines()[0]


def test_who_runs_what_and_for_how_long_it_is_trusted_is_shown() -> None:
    busy = EvaluatorState(
        evaluator="e", state="busy", running=6, trials=[7, 8, 9, 10, 11, 12], lease_s=1.26
    )
    idle = EvaluatorState(evaluator="i", state="idle")
    *_, first, second = drawn(status(evaluators=[busy, idle])).splitlines()
    assert first.split() == [
        "e", "busy", "7,", "8,", "9,", "10", "and", "2", "more", "1.3", "s", "0", "0",
    ]  # fmt: skip
    assert second.split() == ["i", "idle", "-", "-", "0", "0"]


@settings(max_examples=20)  # each draws a whole page
@given(episodes=st.integers(0, 40), evaluators=st.integers(0, 300))
def test_the_table_stays_on_a_screen_however_long_the_run(episodes: int, evaluators: int) -> None:
    history = [
        EpisodeClosed(episode=i, trials=20, successes=i % 21, success_rate=(i % 21) / 20,
                      mean_cost=None, best_cost=0.5, at_s=0.0)
        for i in range(episodes)
    ]  # fmt: skip
    fleet = [EvaluatorState(evaluator=f"e{i}", state="busy") for i in range(evaluators)]
    text = drawn(status(history=history, evaluators=fleet))
    assert len(text.splitlines()) <= 40
    if episodes:
        assert f"{episodes}/10" in text


def test_nothing_known_is_a_dash() -> None:
    assert math.isinf(time_left_s(status(rate_hz=0.0)))
    assert duration(math.inf) == number(None) == number(math.nan) == "-"


@pytest.mark.parametrize(("time_s", "text"), [(0, "0:00"), (59.6, "1:00"), (3725, "62:05")])
def test_durations_are_minutes_and_seconds(time_s: float, text: str) -> None:
    assert duration(time_s) == text
