"""Goal: what a killed learner recommends and confirms is what an undisturbed one does."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from chaos.fleet import Fleet, counts

from shearline.learner.dispatcher.entries import (
    AnyEntry,
    ConfirmationProposed,
    ResultTaken,
    TrialsProposed,
)
from shearline.protocol.messages import OutcomeKind, Purpose, Verdict

pytestmark = pytest.mark.chaos

#: Fails one time in four, whatever the tuple; slow enough to be hurt.
NOISY = """
import time
from shearline.evaluator import task

@task(space={"x": ("m", -1.0, 1.0), "y": ("m", -1.0, 1.0)})
def noisy(theta, rng):
    time.sleep(0.05)
    return theta["x"] ** 2 + theta["y"] ** 2, bool(rng.random() < 0.75)
"""
EPISODES, TRIALS, CONFIRM, REGION = 2, 20, 40, 60


def run(task: Path) -> list[str]:
    return [
        "--task", f"{task}:noisy", "--learner", "psp", "--episodes", str(EPISODES),
        "--trials", str(TRIALS), "--confirm", str(CONFIRM), "--confirm-region", str(REGION),
        "--lease", "1", "--no-record",
    ]  # fmt: skip


def proposals(entries: list[AnyEntry]) -> list[tuple[int, list[float], int]]:
    """Return number, tuple and seed of every trial, in order."""
    opened = [entry for entry in entries if isinstance(entry, TrialsProposed)]
    return [(p.trial, p.theta, p.seed) for entry in opened for p in entry.trials]


def test_a_learner_killed_while_it_confirms_goes_on_where_it_was(tmp_path: Path) -> None:
    (tmp_path / "calm").mkdir()
    task = tmp_path / "mine.py"
    task.write_text(NOISY)
    with Fleet(tmp_path / "calm", run(task)) as calm:
        learner = calm.learner()
        calm.evaluator("one", "--task", f"{task}:noisy")
        expected = calm.outcome(learner)
        undisturbed = proposals(calm.entries())
    with Fleet(tmp_path, run(task)) as fleet:
        learner = fleet.learner()
        for name in ("one", "two"):
            fleet.evaluator(name, "--task", f"{task}:noisy")
        for counted in (EPISODES * TRIALS + 5, EPISODES * TRIALS + CONFIRM + 5):
            fleet.when(counts(counted))
            learner.process.kill()
            learner.process.wait()
            learner = fleet.learner("--resume")
        summary = fleet.outcome(learner)
        fleet.audit()
        entries = fleet.entries()
    assert proposals(entries) == undisturbed
    for name in ("recommendation", "confirmation", "region_confirmation"):
        # The noise of a trial comes from its seed: whoever runs it, it ends the same.
        assert summary[name] == expected[name]
    assert summary["counted"] == EPISODES * TRIALS + CONFIRM + REGION
    assert summary["confirmation"]["successes"] == successes(entries, Purpose.CONFIRMATION)
    assert summary["region_confirmation"]["successes"] == successes(entries, Purpose.REGION)


def successes(entries: list[AnyEntry], purpose: Purpose) -> int:
    """Count them in the journal itself."""
    trials = {
        planned.trial
        for entry in entries
        if isinstance(entry, ConfirmationProposed) and entry.purpose is purpose
        for planned in entry.trials
    }
    return sum(
        entry.verdict is Verdict.COUNTED
        and entry.result.trial in trials
        and entry.result.kind is OutcomeKind.SUCCESS
        for entry in entries
        if isinstance(entry, ResultTaken)
    )


def test_the_record_tells_a_confirmation_from_learning(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(NOISY)
    shearline = [sys.executable, "-m", "shearline.deploy"]
    asked = ["--task", "mine.py:noisy", "--episodes", "1", "--trials", "5", "--confirm", "7"]
    done = subprocess.run(
        [*shearline, "up", *asked, "--out", "run", "--json"],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    summary = json.loads(done.stdout.splitlines()[-1])
    listed = subprocess.run(
        [*shearline, "trials", "run", "--json"],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    rows = [json.loads(line) for line in listed.stdout.splitlines()]
    assert [row["purpose"] for row in rows] == ["learning"] * 5 + ["confirmation"] * 7
    confirmed = rows[5:]
    assert all(row["theta"] == summary["recommendation"]["theta"] for row in confirmed)
    assert len({row["seed"] for row in rows}) == len(rows)
    assert sum(row["success"] for row in confirmed) == summary["confirmation"]["successes"]
    assert [episode["trials"] for episode in summary["episodes"]] == [5]
