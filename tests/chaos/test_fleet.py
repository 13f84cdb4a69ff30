"""A run on real processes that are killed, frozen and restarted counts every trial once."""

from __future__ import annotations

import itertools
import signal
from functools import partial
from pathlib import Path

import pytest
from chaos.fleet import Fleet

from shearline.protocol.messages import Status

pytestmark = pytest.mark.chaos

RUN = [
    "--task",
    "sleep-50",
    "--learner",
    "lhs",
    "--episodes",
    "5",
    "--trials",
    "40",
    "--lease",
    "1",
]
TRIALS = 200


def has_counted(trials: int, status: Status) -> bool:
    return status.counted >= trials


def test_a_killed_and_a_frozen_evaluator_cost_nothing_but_time(tmp_path: Path) -> None:
    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        names = ("steady", "killed", "frozen")
        evaluators = {name: fleet.evaluator(name) for name in names}
        fleet.when(lambda status: status.counted >= 40 and len(status.evaluators) == 3)
        evaluators["killed"].process.kill()
        evaluators["frozen"].process.send_signal(signal.SIGSTOP)
        summary = fleet.outcome(learner)
        assert summary["counted"] == TRIALS
        assert summary["lost"] == 0
        counted = fleet.counted()
        assert sorted(one.trial for one in counted) == list(range(TRIALS))
        # The learner never waits for the dead for longer than a lease and the trial itself.
        assert max(b.at_s - a.at_s for a, b in itertools.pairwise(counted)) < 1.0 + 1.0


def test_a_learner_killed_in_mid_run_finishes_with_everything_it_acknowledged(
    tmp_path: Path,
) -> None:
    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        evaluators = [fleet.evaluator(name) for name in ("one", "two", "three")]
        for counted in (30, 90):
            fleet.when(partial(has_counted, counted))
            learner.process.kill()
            learner.process.wait()
            before = {one.trial: one for one in fleet.counted()}
            assert len(before) >= counted
            learner = fleet.learner("--resume")
        summary = fleet.outcome(learner)
        assert summary["counted"] == TRIALS
        after = {one.trial: one for one in fleet.counted()}
        assert len(after) == len(fleet.counted()) == TRIALS
        assert {trial: after[trial] for trial in before} == before
        assert [child.process.wait(10) for child in evaluators] == [0, 0, 0]


def test_the_record_of_a_run_whose_learner_was_killed_is_whole(tmp_path: Path) -> None:
    from shearline.record.reader import open_run  # noqa: PLC0415 - heavy

    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        fleet.evaluator("one")
        fleet.evaluator("two")
        fleet.when(lambda status: status.counted >= 50)
        learner.process.kill()
        learner.process.wait()
        fleet.outcome(fleet.learner())
        run = open_run(fleet.run_dir)
        assert [row["trial"] for row in run.trials()] == list(range(TRIALS))
        assert len(run.episodes) == 5
