"""The tables: what may follow what, and that nothing else may."""

from __future__ import annotations

import ast
import itertools
from enum import StrEnum
from pathlib import Path
from typing import Any

import pytest

import shearline.learner.dispatcher as package
from shearline.learner.dispatcher.states import (
    ANSWERED,
    ATTEMPT,
    RUN,
    TRIAL,
    AttemptCause,
    AttemptState,
    RunCause,
    RunState,
    Table,
    TrialCause,
    TrialState,
    advance,
)

KINDS = [
    (RUN, RunState, RunCause),
    (TRIAL, TrialState, TrialCause),
    (ATTEMPT, AttemptState, AttemptCause),
]


@pytest.mark.parametrize(("table", "states", "causes"), KINDS)
def test_a_table_knows_every_state_and_leads_only_to_states(
    table: Table[Any, Any], states: type[StrEnum], causes: type[StrEnum]
) -> None:
    assert set(table) == set(states)
    for state, cause in itertools.product(states, causes):
        if cause in table[state]:
            assert advance(table, state, cause) in set(states)
        else:
            with pytest.raises(AssertionError, match="no transition"):
                advance(table, state, cause)


@pytest.mark.parametrize(("table", "states", "causes"), KINDS)
def test_every_state_can_be_reached(
    table: Table[Any, Any], states: type[StrEnum], causes: type[StrEnum]
) -> None:
    start = next(iter(states))
    reached = {start}
    for _ in states:
        reached |= {after for state in reached for after in table[state].values()}
    assert reached == set(states)
    assert {cause for row in table.values() for cause in row} == set(causes)


def test_an_answered_attempt_never_changes_again() -> None:
    assert all(not ATTEMPT[state] for state in ANSWERED)


def test_an_outcome_is_never_taken_back() -> None:
    for state in (TrialState.COUNTED, TrialState.LATE):
        assert set(TRIAL[state].values()) <= {state}


def test_the_dispatcher_imports_no_clock_no_network_and_no_chance() -> None:
    folder = Path(package.__path__[0])
    imported = {
        name
        for path in folder.glob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }
    roots = {name.partition(".")[0] for name in imported}
    assert not roots & {"zenoh", "time", "datetime", "random", "secrets", "threading", "asyncio"}
    assert not {n for n in imported if n.startswith("shearline.protocol.link")}
