"""Journals that real runs wrote lead to the same state for ever."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest
from simulation.golden import RUNS, state_of

from shearline.learner.dispatcher import Book, Dispatcher, check, history
from shearline.learner.dispatcher.entries import (
    AttemptIssued,
    EpisodeDone,
    LearnerBooted,
    ResultTaken,
    RunEnded,
    RunOpened,
    RunRuled,
    TrialLost,
    TrialsProposed,
)
from shearline.learner.dispatcher.events import Begin
from shearline.learner.run.config import from_toml
from shearline.learner.run.journal import Journal, read
from shearline.protocol.messages import Counted

GOLDEN = Path(__file__).parent / "golden"


@pytest.mark.parametrize("name", RUNS)
def test_a_golden_journal_leads_to_the_state_it_led_to(name: str) -> None:
    book = Book.of(read(GOLDEN / f"{name}.journal"))
    state = json.loads(msgspec.json.encode(state_of(book)))
    assert state == json.loads((GOLDEN / f"{name}.json").read_text())


@pytest.mark.parametrize("name", RUNS)
def test_a_golden_journal_is_written_again_byte_for_byte(name: str, tmp_path: Path) -> None:
    path = GOLDEN / f"{name}.journal"
    with Journal(tmp_path / "journal") as journal:
        journal.append(read(path))
    assert (tmp_path / "journal").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("name", RUNS)
def test_every_beginning_of_a_golden_journal_can_be_taken_over(name: str) -> None:
    entries = list(read(GOLDEN / f"{name}.journal"))
    opened = entries[0]
    assert isinstance(opened, RunOpened)
    rules = from_toml(opened.config).rules()
    for end in range(1, len(entries)):
        dispatcher = Dispatcher(rules, lambda: "t" * 16, Book.of(entries[:end]))
        dispatcher.handle(Begin(), 0.0)
        check(dispatcher.desk)


def test_golden_journals_hold_what_journals_hold() -> None:
    kinds = {type(entry) for name in RUNS for entry in read(GOLDEN / f"{name}.journal")}
    assert kinds >= {
        RunOpened,
        LearnerBooted,
        TrialsProposed,
        AttemptIssued,
        ResultTaken,
        TrialLost,
        EpisodeDone,
        RunRuled,
        RunEnded,
    }


def test_observers_are_told_of_every_trial_of_a_golden_journal() -> None:
    told = [m.trial for m in history(read(GOLDEN / "rough.journal")) if isinstance(m, Counted)]
    assert sorted(told) == list(range(12))
