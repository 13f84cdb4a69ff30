"""Runs to report on: small ones with everything in them, and what a reader sees of a page."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from shearline.protocol.codec import encode
from shearline.protocol.messages import (
    Counted,
    EvaluatorState,
    OutcomeKind,
    Purpose,
    Result,
    Snapshot,
    Wire,
)
from shearline.record.head import config_of
from shearline.record.report.facts import Facts, gather
from shearline.record.report.markup import VOID
from shearline.record.writer import RecordWriter

BEGIN_S = 1_700_000_000.0
NAMES = ("ins_push", "ins_speed", "wig_a_x", "wig_f_x", "ins_k_rot")


def _summary(**other: Any) -> dict[str, Any]:
    """What a finished run says of itself."""
    middle = dict(zip(NAMES, (12.0, 0.05, 5.0, 1.5, 100.0), strict=True))
    radius = dict(zip(NAMES, (3.0, 0.01, 1.0, 0.5, 300.0), strict=True))
    region = {"centre": middle, "radius": radius, "success_low": 0.81, "confidence": 0.95}
    advice = {
        "theta": middle,
        "success_probability": 0.93,
        "interval": [0.85, 1.0],
        "cost": 0.41,
        "region": region | {"trials": 40, "successes": 37},
    }
    counts = {"counted": 8, "lost": 0, "late": 0, "duplicates": 1, "aborted": 0, "rejected": 0}
    said = {"run": "synthetic", "recommendation": advice, "wall_s": 12.5, "state": "complete"}
    return said | counts | {"why": ""} | other


def _machine(episode: int, intercept: float = 0.5) -> Snapshot:
    """A learner's model whose partition is positive near the middle of the space."""
    partition = {"kind": "svm-rbf", "support": [[0.5] * 5], "dual": [1.0], "gamma": 4.0}
    mixture = {"means": [[0.5] * 5], "covariances": [[[0.01] * 5] * 5]}
    model = {"episode": episode, "partition": partition | {"intercept": intercept - 1.0}}
    model["mixture"] = mixture
    return Snapshot(episode=episode, learner="psp", model=json.dumps(model), at_s=BEGIN_S)


def _outcome(trial: int, kind: OutcomeKind | None, **other: Any) -> Counted:
    """One trial in the middle of the space."""
    fields: dict[str, Any] = {
        "trial": trial,
        "episode": 0,
        "theta": [10.0, 0.05, 5.0, 1.5, 100.0],
        "kind": kind,
        "cost": 0.0 if kind is None else 1.0 + trial,
        "seed": trial,
        "evaluator": "sim-0",
        "attempts": 1,
        "late": False,
        "engine": "engine 1",
        "digest": "",
        "wall_s": 0.5,
        "why": "" if kind is OutcomeKind.SUCCESS else "time",
        "extras": {},
        "at_s": BEGIN_S + trial,
    }
    return Counted(**(fields | other))


def _state(name: str, word: str, at_s: float, **counts: Any) -> EvaluatorState:
    return EvaluatorState(evaluator=name, state=word, at_s=BEGIN_S + at_s, **counts)


def _aborted(trial: int, why: str, token: str) -> Wire:
    result = Result(
        boot="boot-000",
        token=token,
        trial=trial,
        kind=OutcomeKind.ABORTED,
        cost=0.0,
        seed=1,
        why=why,
    )
    key = "shearline/@v1/synthetic/ev/sim-0/result"
    return Wire(sent=False, key=key, payload=encode(result), at_s=BEGIN_S)


Write = Callable[..., Path]


@pytest.fixture
def outcome() -> Callable[..., Counted]:
    """Make an outcome: number, kind, and whatever else matters."""
    return _outcome


@pytest.fixture
def state() -> Callable[..., EvaluatorState]:
    """Make an evaluator's state: name, word, seconds since the run began."""
    return _state


@pytest.fixture
def begin_s() -> float:
    """When the runs here began [s since the epoch]."""
    return BEGIN_S


@pytest.fixture
def write_messages(run_dir: Path) -> Write:
    """Add messages to the record of the run folder, in a part of their own."""

    def write(*messages: Any, said: dict[str, Any] | None = None) -> Path:
        now_ns = time.time_ns()
        with RecordWriter(run_dir, config_of("synthetic", run_dir)) as writer:
            for i, message in enumerate(messages):
                writer.write(message, log_ns=now_ns + i)
        if said is not None:
            (run_dir / "summary.json").write_text(json.dumps(said), encoding="utf-8")
        return run_dir

    return write


@pytest.fixture
def whole(write_run: Callable[..., Path], write_messages: Write) -> Path:
    """A finished run with everything that a report can show."""
    write_run(episodes=3, per_episode=8)
    confirming = {"episode": 3, "purpose": Purpose.CONFIRMATION}
    fresh = [
        _outcome(24, OutcomeKind.SUCCESS, **confirming, evaluator_kind="robot"),
        _outcome(25, OutcomeKind.FAILURE, **confirming, evaluator_kind="robot"),
    ]
    confirmation = {
        "claimed": 0.85,
        "trials": 2,
        "successes": 1,
        "interval": [0.09, 0.91],
        "lost": 0,
        "bears_out": True,
    }
    return write_messages(
        _state("sim-0", "busy", 1.0, done=0),
        _state("sim-1", "silent", 2.0, done=3, lost=1),
        _machine(3),
        *fresh,
        _outcome(26, None, episode=2, why="3 attempts lost"),
        _aborted(5, "the engine <stopped>", "token-00"),
        _aborted(5, "the engine <stopped>", "token-00"),
        _aborted(7, "the engine <stopped>", "token-01"),
        said=_summary(confirmation=confirmation, lost=1, aborted=2),
    )


@pytest.fixture
def facts(whole: Path) -> Facts:
    return gather(whole)


class Seen(HTMLParser):
    """What is on a page: its text, and its elements with their attributes.

    Complains of an element that is closed in the wrong order or not at all.
    """

    def __init__(self, page: str) -> None:
        super().__init__()
        self.text = ""
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self._open: list[str] = []
        self.feed(page)
        self.close()
        assert not self._open, f"never closed: {self._open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] not in {"style", "script"}:
            self.text += data

    def classes(self) -> Iterator[str]:
        """Yield every class of every element."""
        for _, attributes in self.elements:
            yield from (attributes.get("class") or "").split()

    def count(self, kind: str) -> int:
        """Return how many elements have a class."""
        return list(self.classes()).count(kind)


@pytest.fixture
def see() -> Callable[[str | None], Seen]:
    return lambda page: Seen(page or "")
