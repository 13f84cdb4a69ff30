"""A replayed trial beside the recorded one, as the viewer gets it."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from shearline.deploy.cli import main
from shearline.deploy.replay import show
from shearline.deploy.replay.recorded import Recorded
from shearline.evaluator.base import Task
from shearline.evaluator.replay import Change, again
from shearline.evaluator.tasks import load_task
from shearline.protocol.messages import OutcomeKind
from shearline.record.reader import open_run
from shearline.record.viewer import executable


@pytest.fixture(scope="module")
def keylock() -> Task:
    return load_task("keylock")


def listed(path: Path) -> str:
    """Return what Rerun's own tool finds in a file."""
    return subprocess.run(
        [executable(), "rrd", "print", path], capture_output=True, text=True, check=True
    ).stdout


def test_a_file_has_both_trials_side_by_side(
    keylock_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.rrd"
    words = ["replay", str(keylock_run), "--trial", "1", "--with", "push=3", "--save", str(path)]
    assert main(words) == 0
    assert f"rerun {path}" in capsys.readouterr().err
    found = listed(path)
    for root in ("/a", "/b"):
        for entity in ("card", "signals/depth", "phase"):
            assert f" - {root}/{entity} - " in found


def test_pages_are_named_by_what_they_show(keylock_run: Path, keylock: Task) -> None:
    run = open_run(keylock_run)
    case = Recorded(run).case(1)
    both = show.shape(run, again(keylock, case))
    assert list(both.titles) == ["trial 1, recorded", "trial 1, replayed"]
    alone = show.shape(run, again(keylock, replace(case, outcome=None)))
    assert list(alone.titles) == ["trial 1, replayed"]
    assert both.tip is not None


def test_a_replayed_outcome_says_what_came_out(keylock_run: Path, keylock: Task) -> None:
    case = Recorded(open_run(keylock_run)).case(1)
    assert case.outcome is not None
    outcome = show.as_outcome(again(keylock, case, Change(seed=9)))
    assert (outcome.seed, outcome.evaluator) == (9, "replay")
    same = show.as_outcome(again(keylock, case))
    kept = ("trial", "theta", "kind", "cost", "seed", "engine", "digest", "why", "extras")
    for name in kept:
        assert getattr(same, name) == getattr(case.outcome, name), name


def test_an_aborted_replay_has_no_outcome(sphere_run: Path) -> None:
    case = Recorded(open_run(sphere_run)).case(0)
    replayed = again(load_task("sphere"), replace(case, theta=(99.0, *case.theta[1:])))
    assert replayed.verdict.kind is OutcomeKind.REJECTED
    outcome = show.as_outcome(replayed)
    assert outcome.kind is None
    assert "x0 = 99" in outcome.why
    assert msgspec.msgpack.encode(outcome)
