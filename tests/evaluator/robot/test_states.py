"""The table of the arm's states, and the page that shows it."""

from __future__ import annotations

from pathlib import Path

import pytest

from shearline.evaluator.robot.diagram import mermaid
from shearline.evaluator.robot.states import (
    MOVING,
    OPERATOR,
    STUCK,
    TABLE,
    Cause,
    State,
    advance,
)

PAGE = Path(__file__).resolve().parents[3] / "docs" / "robot.md"


def reachable(start: State, causes: set[Cause]) -> set[State]:
    found, new = {start}, {start}
    while new:
        new = {after for s in new for c, after in TABLE[s].items() if c in causes} - found
        found |= new
    return found


def test_the_page_shows_the_table_that_the_program_uses() -> None:
    assert f"```mermaid\n{mermaid()}\n```" in PAGE.read_text()


@pytest.mark.parametrize("state", State)
def test_the_page_says_what_every_state_means(state: State) -> None:
    assert f"**{state}**" in PAGE.read_text()


@pytest.mark.parametrize("state", STUCK)
def test_a_broken_state_is_left_by_an_operators_act_alone(state: State) -> None:
    assert set(TABLE[state]) <= OPERATOR


def test_nothing_moves_that_no_operator_armed() -> None:
    remote = set(Cause) - OPERATOR
    for state in {State.OFFLINE, State.IDLE, *STUCK}:
        assert not reachable(state, remote) & MOVING


def test_after_a_stop_or_a_fault_nothing_moves_before_an_operator_confirms() -> None:
    for cause in (Cause.STOP, Cause.FAIL):
        for state in MOVING | {State.READY, State.PAUSED}:
            broken = advance(state, cause)
            assert broken in STUCK
            without = set(Cause) - {Cause.CONFIRM, Cause.EXTRACT}
            assert not reachable(broken, without) & MOVING


def test_every_state_can_be_reached() -> None:
    assert reachable(State.OFFLINE, set(Cause)) == set(State)


def test_a_transition_that_the_table_lacks_is_a_programming_error() -> None:
    with pytest.raises(AssertionError, match="no transition from"):
        advance(State.HOLD, Cause.TRIAL)
