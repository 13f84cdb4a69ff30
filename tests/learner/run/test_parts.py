"""The small parts of the run: fitter, signals, incoming."""

from __future__ import annotations

import json
import signal
from collections.abc import Mapping
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
import pytest
from simulation.lab import Lab

from shearline.learner import Learner, Proposal, Space, create
from shearline.learner.dispatcher import Book
from shearline.learner.dispatcher.events import (
    EvaluatorGone,
    LearnerFailed,
    OperatorCommand,
    ProposalsReady,
)
from shearline.learner.dispatcher.instructions import Ask
from shearline.learner.random_search import RandomSearch
from shearline.learner.run.fitter import Fitter, Recommended, model_json
from shearline.learner.run.incoming import COMPLAINTS_MAX, Incoming
from shearline.learner.run.seeds import trial_seed
from shearline.learner.run.signals import Hurry, signals_to
from shearline.protocol.intake import Arrival, Presence
from shearline.protocol.messages import CommandKind

SPACE = Space({"x": ("", 0.0, 1.0)})
ANSWER_S = 20.0


class Astray(RandomSearch):
    """A learner that proposes what nobody may try."""

    def ask(self, n: int) -> list[Proposal]:
        return [Proposal(p.trial, p.theta + 2.0) for p in super().ask(n)]


class Forgetful(RandomSearch):
    """A learner that always counts from 7."""

    def ask(self, n: int) -> list[Proposal]:
        return [Proposal(p.trial + 7, p.theta) for p in super().ask(n)]


class Fitting(RandomSearch):
    """A learner that loads something heavy when told to, and says so."""

    box: SimpleQueue[Any]

    def warm(self) -> None:
        self.box.put("warm")


class Odd(RandomSearch):
    """A learner whose model is not fit for JSON as it is."""

    def snapshot(self) -> Mapping[str, object]:
        return {"a": np.array([1.0, np.nan]), "b": (np.float64(2.0), {"c": float("inf")})}


def answers(learner: Any, ask: Ask, book: Book | None = None) -> list[Any]:
    """Return everything the fitter puts in until its last word."""
    box = SimpleQueue[Any]()
    fitter = Fitter(learner, 3, box)
    fitter.start(book or Book())
    fitter.ask(ask)
    fitter.finish(())
    found = [box.get(timeout=ANSWER_S)]
    while not isinstance(found[-1], Recommended):
        found.append(box.get(timeout=ANSWER_S))
    return found


def random_search() -> Learner:
    return create("random", SPACE, episode_length=4, seed=3)


def test_a_fitter_answers_with_seeded_proposals_then_its_last_word() -> None:
    first, _, last = answers(random_search, Ask(0, 4, (), 0))
    assert isinstance(first, ProposalsReady)
    assert [p.trial for p in first.trials] == [0, 1, 2, 3]
    assert [p.seed for p in first.trials] == [trial_seed(3, n) for n in range(4)]
    assert last.recommendation is not None


def test_a_learner_loads_what_it_needs_later_once_evaluators_have_work() -> None:
    box = SimpleQueue[Any]()

    def make() -> Learner:
        learner = Fitting(SPACE, 4, 3)
        learner.box = box
        return learner

    fitter = Fitter(make, 3, box)
    fitter.start(Book())
    for episode in range(2):
        fitter.ask(Ask(episode, 4, (), 4 * episode))
    fitter.finish(())
    kinds = [type(box.get(timeout=ANSWER_S)).__name__ for _ in range(6)]
    assert kinds == [
        "ProposalsReady",
        "Modelled",
        "str",
        "ProposalsReady",
        "Modelled",
        "Recommended",
    ]


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (lambda: Astray(SPACE, 4, 3), "out of bounds"),
        (lambda: Forgetful(SPACE, 4, 3), "expected trials from 0 on"),
        (lambda: 1 / 0, "ZeroDivisionError"),
    ],
)
def test_a_learner_that_breaks_its_contract_fails_in_one_sentence(make: Any, why: str) -> None:
    failed, last = answers(make, Ask(0, 4, (), 0))
    assert isinstance(failed, LearnerFailed)
    assert why in failed.why
    assert last.recommendation is None


def test_a_run_that_another_learner_proposed_is_not_gone_on_with() -> None:
    lab = Lab(trials=4)
    lab.propose()
    failed, _ = answers(random_search, Ask(1, 4, (), 4), lab.dispatcher.book)
    assert "proposed by another version of the learner" in failed.why


def test_a_model_becomes_json_whatever_is_in_it() -> None:
    model = json.loads(model_json(Odd(SPACE, 4, 0)))
    assert model == {"a": [1.0, None], "b": [2.0, {"c": None}]}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_first_signal_stops_and_the_second_hurries(number: signal.Signals) -> None:
    box = SimpleQueue[Any]()
    before = signal.getsignal(number)
    with signals_to(box):
        signal.raise_signal(number)
        signal.raise_signal(number)
        first, second = box.get(timeout=1.0), box.get(timeout=1.0)
    assert isinstance(first, OperatorCommand)
    assert first.kind is CommandKind.STOP
    assert number.name in first.why
    assert second == Hurry()
    assert signal.getsignal(number) is before
    with pytest.raises(Empty):
        box.get_nowait()


def test_what_is_not_for_the_learner_is_no_event() -> None:
    incoming = Incoming()
    root = "shearline/@v1/r"
    assert incoming.event(Arrival(f"{root}/ev/a/trial", b"")) is None
    assert incoming.event(Presence(f"{root}/live/ev/a/boot-a", alive=True)) is None
    assert incoming.event(Presence(f"{root}/live/learner/3", alive=False)) is None
    gone = incoming.event(Presence(f"{root}/live/ev/a/boot-a", alive=False))
    assert gone == EvaluatorGone("a", "boot-a")
    assert incoming.malformed == 0


def test_a_log_is_not_filled_by_whoever_sends_garbage(caplog: pytest.LogCaptureFixture) -> None:
    incoming = Incoming()
    for _ in range(3 * COMPLAINTS_MAX):
        assert incoming.event(Arrival("shearline/@v1/r/ev/a/result", b"\xff")) is None
    assert incoming.malformed == 3 * COMPLAINTS_MAX
    assert len(caplog.records) == COMPLAINTS_MAX
