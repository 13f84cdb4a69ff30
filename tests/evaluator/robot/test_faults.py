"""What stops the arm, and what of robot, port or disk it does not trust: one answer, no motion."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from evaluator.robot.rig import Rig, Spy, attempt, lying, stage

from shearline.evaluator.robot.errors import Ending, MotionEnded, RobotRefused
from shearline.evaluator.robot.port import Mode
from shearline.evaluator.robot.spool import Spool
from shearline.evaluator.robot.states import State
from shearline.protocol.messages import OutcomeKind

Make = Callable[..., Rig]

# -- stops ---------------------------------------------------------------------------------------


def user_stop(port: Any, what: str) -> None:
    if what == "ref":
        raise MotionEnded(Ending.USER_STOP, "the user stop was pressed")
    port.sample()


def test_a_user_stop_holds_the_arm_until_the_operator_recovers_and_confirms(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy).armed()
    spy.interfere = user_stop
    answer = arm.run(attempt())
    assert answer.result.kind is OutcomeKind.ABORTED
    assert arm.state is State.HOLD
    assert not arm.takes()
    spy.interfere = lambda *_: None  # the button is released
    spy.moves.clear()
    for number in range(1, 4):
        arm.tick()
        arm.run(attempt(number))
    assert spy.moves == []
    assert arm.store.key_in_lock
    arm.type("recover")
    assert (arm.state, spy.moves) == (State.IDLE, [])
    arm.armed()
    assert "pulling out the key" in arm.printed
    assert not arm.store.key_in_lock


def test_exactly_one_result_is_kept_for_a_stopped_trial(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy).armed()
    spy.interfere = user_stop
    asked = attempt()
    arm.run(asked)
    arm.run(asked)
    (kept,) = Spool(arm.store.folder / "spool").pending("run-1")
    assert (kept.token, kept.kind) == (asked.trial.token, OutcomeKind.ABORTED)


def test_the_log_of_a_stopped_trial_is_written(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy).armed()
    spy.interfere = user_stop
    arm.run(attempt())
    (path,) = (arm.store.folder / "logs").glob("*.npy")
    log = np.load(path)
    np.testing.assert_allclose(np.diff(log[:, 0]), 1e-3, atol=1e-9)


def test_the_operators_stop_brakes_at_once_and_holds(rig: Make) -> None:
    arm = rig().armed()
    arm.port.stop()
    arm.type("stop")
    assert arm.state is State.HOLD
    with pytest.raises(MotionEnded):
        arm.port.contact(None)  # type: ignore[arg-type]  # latched: nobody looks at it


@pytest.mark.parametrize(
    "lies",
    [
        {"o_f_ext": np.zeros(6)},
        {"q": np.full(3, np.nan)},
        {"o_t_ee": np.zeros((4, 4))},
        {"t_s": 0.0},
    ],
    ids=["zero wrench", "nan", "no pose", "clock"],
)
def test_a_port_that_lies_is_a_fault_and_never_a_cost(rig: Make, lies: dict[str, Any]) -> None:
    port = lying()
    arm = rig(port).armed()
    port.lies |= lies
    answer = arm.run(attempt())
    assert answer.result.kind is OutcomeKind.ABORTED
    assert arm.state is State.FAULT


def test_a_stop_seen_between_trials_holds_the_arm(rig: Make) -> None:
    port = lying()
    arm = rig(port).armed()
    port.lies["mode"] = Mode.USER_STOPPED
    arm.tick()
    assert arm.state is State.HOLD


def test_a_trial_does_not_begin_with_the_key_in_the_lock(rig: Make) -> None:
    arm = rig(stage("hand")).armed_or_not()
    assert arm.state is State.FAULT
    assert "free the key first" in arm.printed


# -- ports and disks that fail -------------------------------------------------------------------


@pytest.mark.parametrize("what", ["move_free", "contact", "ref"])
@pytest.mark.parametrize("fault", [RobotRefused("not now"), OSError("no space left")])
def test_an_error_that_is_no_ending_is_a_fault_with_one_result(
    rig: Make, what: str, fault: Exception
) -> None:
    spy = Spy()
    arm = rig(spy).armed()

    def fail(_stage: Any, called: str) -> None:
        if called == what:
            raise fault

    spy.interfere = fail
    answer = arm.run(attempt())
    assert (answer.result.kind, answer.result.why) == (OutcomeKind.ABORTED, str(fault))
    assert arm.state is State.FAULT
    assert Spool(arm.store.folder / "spool").pending("run-1") == [answer.result]


def test_an_extraction_that_is_refused_is_a_fault_with_the_key_in_the_lock(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy).armed()

    def fail(_stage: Any, _what: str) -> None:
        if arm.state is State.RETRACT:
            raise RobotRefused("not now")

    spy.interfere = fail
    arm.run(attempt())
    assert arm.state is State.FAULT
    assert arm.store.key_in_lock


def test_a_wear_file_damaged_while_the_arm_is_armed_is_a_fault_with_an_answer(rig: Make) -> None:
    arm = rig().armed()
    (arm.store.folder / "wear.json").write_text("{")
    answer = arm.run(attempt())
    assert answer.result.kind is OutcomeKind.ABORTED
    assert "damaged" in answer.result.why
    assert arm.state is State.FAULT


def test_a_result_that_cannot_be_kept_is_said_and_no_more_are_made(
    rig: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = rig().armed()

    def full(*_: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(Spool, "put", full)
    assert arm.run(attempt()).result.kind is OutcomeKind.SUCCESS
    assert arm.state is State.FAULT


def test_calls_that_may_last_are_no_silence(rig: Make) -> None:
    spy, left_s = Spy(), []
    arm = rig(spy)
    spy.interfere = lambda _stage, what: left_s.append((what, patience(arm)))
    end = spy.stage.end

    def ends() -> None:
        left_s.append(("end", patience(arm)))
        end()

    spy.stage.end = ends
    arm.armed().run(attempt())
    lasting = [(what, left) for what, left in left_s if what != "ref"]
    assert {what for what, _ in lasting} == {"move_free", "contact", "end"}
    assert min(left for _, left in lasting) > 10.0


def patience(arm: Rig) -> float:
    """Return for how long the arm's thread promised to be well [s]."""
    return arm.arm.alive_until_s - time.monotonic()


# -- logs ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "keep",
    [
        lambda log: log[:0],
        lambda log: np.delete(log, len(log) // 2, axis=0),
        lambda log: np.repeat(log[::2], 2, axis=0),
    ],
    ids=["empty", "one row less", "each second row twice"],
)
def test_a_log_that_lacks_a_cycle_makes_no_success(
    rig: Make, keep: Callable[[np.ndarray], np.ndarray]
) -> None:
    port = lying(mode=Mode.IDLE)  # nor does it ever say that it moves
    arm = rig(port).armed()
    true = port.drain_log
    port.drain_log = lambda: keep(true())
    answer = arm.run(attempt())
    assert answer.result.kind is OutcomeKind.ABORTED
    assert "log lacks" in answer.result.why
