"""The record of a run survives what its learner does not."""

from __future__ import annotations

from pathlib import Path

import pytest
from chaos.fleet import Fleet, counts

pytestmark = pytest.mark.chaos

RUN = [
    "--task", "sleep-40", "--learner", "lhs", "--episodes", "3", "--trials", "30", "--lease", "1",
]  # fmt: skip


def test_the_record_of_a_run_whose_learner_was_killed_is_whole(tmp_path: Path) -> None:
    from shearline.record.reader import open_run  # noqa: PLC0415 - heavy

    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        fleet.evaluator("one")
        fleet.evaluator("two")
        fleet.when(counts(35))
        learner.process.kill()
        learner.process.wait()
        fleet.outcome(fleet.learner())
        fleet.audit()
        run = open_run(fleet.run_dir)
        assert [row["trial"] for row in run.trials()] == list(range(90))
        assert len(run.episodes) == 3
