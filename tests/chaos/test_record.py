"""Whoever is killed, the record has every acknowledged outcome once the run was started again."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from chaos.fleet import Fleet, counts

from shearline.record.reader import open_run

pytestmark = pytest.mark.chaos

RUN = ["--task", "sleep-40", "--learner", "lhs", "--episodes", "3", "--trials", "20"]


def recorder_of(learner_pid: int) -> int:
    """Return the process that records a learner's run: a child of any of its threads."""
    tasks = list(Path(f"/proc/{learner_pid}/task").iterdir())
    pids = [pid for task in tasks for pid in (task / "children").read_text().split()]
    named = b"shearline.record.recorder"
    found = [int(pid) for pid in pids if named in Path(f"/proc/{pid}/cmdline").read_bytes()]
    assert len(found) == 1, f"the learner has {len(found)} recorders"
    return found[0]


def test_recorder_evaluator_and_learner_are_killed_and_no_acknowledged_outcome_is_missing(
    tmp_path: Path,
) -> None:
    with Fleet(tmp_path, [*RUN, "--lease", "1"]) as fleet:
        learner = fleet.learner()
        victim = fleet.evaluator("one")
        fleet.evaluator("two")
        fleet.when(counts(8))
        os.kill(recorder_of(learner.process.pid), signal.SIGKILL)
        fleet.when(counts(16))
        victim.process.kill()
        fleet.when(counts(24))
        learner.process.kill()
        learner.process.wait()
        acknowledged = {row.trial for row in fleet.counted()}
        fleet.evaluator("three")
        fleet.outcome(fleet.learner("--resume"))
        run = open_run(fleet.run_dir)
        assert len(acknowledged) >= 24
        assert acknowledged <= {row.trial for row in run.outcomes}
        assert run.outcomes == sorted(fleet.counted(), key=lambda row: row.trial)
        assert [episode.episode for episode in run.episodes] == [0, 1, 2]
        assert run.damage == []
