"""The worker's side of a robot: another process, its death, its silence, and what is owed."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from evaluator.robot.cell import Cell
from evaluator.robot.rig import attempt
from evaluator.tiny_learner import TinyLearner, working

from shearline.evaluator.base import Attended
from shearline.evaluator.keylock_spec import keylock_spec
from shearline.evaluator.robot.task import RobotDown, RobotTask
from shearline.protocol.errors import ConfigError
from shearline.protocol.messages import JUDGED, Bye, Credit, OutcomeKind, Result, Verdict

pytestmark = pytest.mark.slow


@pytest.fixture
def cell(tmp_path: Path) -> Cell:
    return Cell(tmp_path)


def test_a_robot_is_an_attended_task_of_the_learners_own_spec(cell: Cell) -> None:
    task = RobotTask(cell.orders())
    assert isinstance(task, Attended)
    assert task.spec == keylock_spec()
    assert task.kind == "robot"


def test_a_trial_runs_in_the_other_process_and_comes_back_whole(cell: Cell) -> None:
    with cell:
        outcome = cell.armed().start().outcome()
        assert outcome.success
        assert outcome.trace is not None
        assert outcome.trace.columns["depth"][1].max() > 0.024
        assert "stage 1 bounds" in cell.task.engine
        (kept,) = cell.spooled()
        assert kept.cost == outcome.cost


def test_what_the_lab_does_not_allow_comes_back_as_rejected(cell: Cell) -> None:
    with cell:
        assert "outside" in cell.armed().start(theta=cell.theta(ins_push=21.0)).rejected()


@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGSTOP])
def test_an_arms_process_that_dies_or_freezes_is_noticed_and_ended(
    cell: Cell, sent: signal.Signals
) -> None:
    with cell:
        cell.armed()
        running = cell.start(theta=cell.theta(con_speed=0.005, ins_push=0.0, con_force=1.0))
        cell.until(cell.in_contact, "contact")
        cell.process.send_signal(sent)
        assert "the key may be in the lock" in running.aborted()
        assert cell.process.wait(10.0) == -signal.SIGKILL
        assert not cell.ready.is_set()
        assert [code for code, _ in cell.said] == [4]
        assert cell.start(1).aborted()


@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGSTOP])
def test_an_arms_process_that_dies_or_freezes_between_trials_is_noticed_too(
    cell: Cell, sent: signal.Signals
) -> None:
    with cell:
        cell.armed()
        cell.process.send_signal(sent)
        assert cell.process.wait(10.0) == -signal.SIGKILL
        cell.until(lambda: cell.said, "the end")
        assert [code for code, _ in cell.said] == [4]
        assert not cell.ready.is_set()


def test_a_trial_that_is_stopped_ends_in_order_however_long_that_takes(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The example's stage computes six seconds in a few beats: none of them may be waited for.
    monkeypatch.setattr("shearline.evaluator.robot.task.BEAT_S", 0.001)
    with cell:
        cell.armed()
        running = cell.start(theta=cell.theta(con_speed=0.005, ins_push=0.0, con_force=1.0))
        cell.until(cell.in_contact, "contact")
        running.stop("the worker leaves")
        assert "the worker leaves" in running.aborted()
        assert not cell.in_contact()
        assert cell.process.poll() is None
        (kept,) = cell.spooled()
        assert kept.kind is OutcomeKind.ABORTED


def test_closing_waits_until_the_key_is_out_and_the_process_has_ended(cell: Cell) -> None:
    with cell:
        cell.armed()
        cell.start(theta=cell.theta(con_speed=0.005))
        cell.until(cell.in_contact, "contact")
        cell.task.close()
        assert cell.process.poll() == 0
        assert not cell.in_contact()


def test_what_was_measured_is_found_though_nobody_was_left_to_say_it(cell: Cell) -> None:
    with cell:
        asked = attempt(theta=cell.theta())
        measured = Result(
            boot=asked.trial.boot,
            token=asked.trial.token,
            trial=asked.trial.trial,
            kind=OutcomeKind.SUCCESS,
            cost=2.5,
            seed=0,
        )
        cell.process.send_signal(signal.SIGSTOP)
        cell.task.spool.put(asked.run, measured)  # as the arm does just before it dies
        assert cell.start(theta=cell.theta()).outcome().cost == measured.cost


def test_a_robot_that_is_refused_ends_before_it_begins(cell: Cell) -> None:
    (cell.state / "calibration.json").unlink()
    with pytest.raises(RobotDown, match="--calibrate"), cell:
        pass
    (cell.folder / "lab.toml").write_text("")
    with pytest.raises(ConfigError, match="missing required field"), cell:
        pass


def test_the_arms_process_outlives_its_worker_to_bring_the_key_out(cell: Cell) -> None:
    with cell:
        cell.armed()
        cell.start(theta=cell.theta(con_speed=0.005))
        cell.until(cell.in_contact, "contact")
        assert cell.task._pipe is not None
        cell.task._pipe.close()  # as the death of the worker does
        assert cell.process.wait(30.0) == 0
        assert not cell.in_contact()
        (kept,) = cell.spooled()
        assert kept.kind in JUDGED


# -- with a worker ---------------------------------------------------------------------------------


def test_a_worker_has_no_credit_before_the_operator_confirmed_and_one_after(
    cell: Cell, learner: TinyLearner
) -> None:
    learner.spec = keylock_spec()
    task, types = attended(cell)
    with working(learner.endpoint, task):
        hello = learner.welcome()
        assert (hello.kind, hello.credits) == ("robot", 0)
        assert learner.next(Credit).credits == 0
        types("confirm")
        while (credit := learner.next(Credit)).credits == 0:
            pass  # the rehearsal takes its time, and signs of life go on coming
        assert credit.credits == 1
        learner.give(hello, 1, cell.theta(), deadline_s=60.0)
        result = learner.take()
        assert result.kind is OutcomeKind.SUCCESS
        assert "bounds" in result.engine
        learner.stop()
        learner.next(Bye)
    task.close()
    assert task.spool.pending("run-1") == []


def test_when_the_run_ends_in_a_trial_the_worker_stays_until_the_arms_process_has_ended(
    cell: Cell, learner: TinyLearner
) -> None:
    learner.spec = keylock_spec()
    task, types = attended(cell)
    with working(learner.endpoint, task) as worker:
        hello = learner.welcome()
        types("confirm")
        while learner.next(Credit).credits == 0:
            pass
        endless = cell.theta(con_speed=0.005, ins_push=0.0, con_force=1.0)
        learner.give(hello, 1, endless, deadline_s=60.0)
        cell.until(cell.in_contact, "contact")
        learner.stop()
        assert learner.take(Verdict.NOTED).token == "token-000001"
        learner.next(Bye)
        assert worker.end().code == 0
        assert task._process is not None
        assert task._process.poll() == 0
        assert worker.exits.empty()
        assert not cell.in_contact()


def test_what_was_owed_by_an_earlier_process_is_delivered_once(
    cell: Cell, learner: TinyLearner
) -> None:
    learner.spec = keylock_spec()
    task, _ = attended(cell)
    owed = Result(
        boot="boot-of-before",
        token="token-owed",
        trial=5,
        kind=OutcomeKind.SUCCESS,
        cost=2.0,
        seed=1,
    )
    task.spool.put("run-1", owed)
    task.spool.put(
        "another", Result(boot="b" * 8, token="t" * 8, trial=0, kind=owed.kind, cost=1.0, seed=1)
    )
    with working(learner.endpoint, task):
        hello = learner.welcome()
        result = learner.take(Verdict.COUNTED)
        assert (result.token, result.cost, result.boot) == ("token-owed", 2.0, hello.boot)
        learner.next(Credit)
        learner.stop()
        learner.next(Bye)
        assert len({m.token for m in learner.heard if isinstance(m, Result)}) == 1
    task.close()
    assert task.spool.pending("run-1") == []
    assert len(task.spool.pending("another")) == 1


def attended(cell: Cell) -> tuple[RobotTask, Callable[[str], int]]:
    """Return a robot's task whose terminal the test types at."""
    reads, writes = os.pipe()
    return RobotTask(cell.orders(), reads), lambda word: os.write(writes, f"{word}\n".encode())
