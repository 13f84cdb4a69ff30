"""The operator at the robot's terminal: what a word does, when it counts, and what hands do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from evaluator.robot.rig import Rig, Spy, answering, attempt, bounds, lying, stage

from shearline.evaluator.robot.port import Mode
from shearline.evaluator.robot.states import State
from shearline.evaluator.robot.store import Store
from shearline.evaluator.robot.terminal import Line
from shearline.protocol.messages import OutcomeKind

Make = Callable[..., Rig]

LONG_AGO_S = 0.0


def test_nothing_moves_before_an_operator_confirms(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy)
    for number in range(3):
        answer = arm.run(attempt(number))
        assert answer.result.kind is OutcomeKind.ABORTED
        assert "waits for its operator" in answer.result.why
    arm.type("", "yes", "resume", "recover", "go")
    assert spy.moves == []
    assert arm.state is State.IDLE
    assert not arm.takes()


def test_a_confirmed_arm_rehearses_slowly_and_then_takes_trials(rig: Make) -> None:
    arm = rig().armed()
    assert "rehearsal: success" in arm.printed
    assert arm.takes()
    log = arm.port.drain_log()
    assert len(log) < 100  # the rehearsal's log went with it


# -- the rehearsal -------------------------------------------------------------------------------


def test_a_rehearsal_that_was_halted_lets_no_trial_in_until_one_succeeds(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy)

    def halt(_stage: Any, what: str) -> None:
        if what == "ref":
            arm.arm.peer.leaving = "the worker leaves"

    spy.interfere = halt
    arm.type("confirm")
    assert (arm.state, arm.takes()) == (State.READY, False)
    assert "type 'confirm' to rehearse" in arm.printed
    spy.interfere = lambda *_: None
    arm.arm.peer.leaving = ""
    spy.moves.clear()
    assert arm.run(attempt()).result.kind is OutcomeKind.ABORTED
    assert spy.moves == []
    arm.type("confirm")
    assert (arm.state, arm.takes()) == (State.READY, True)


def test_a_rehearsal_that_failed_lets_no_trial_in(rig: Make) -> None:
    arm = rig()
    arm.port.slide.resistance = wall  # type: ignore[attr-defined]
    arm.type("confirm")
    assert (arm.state, arm.takes()) == (State.READY, False)


def wall(at: np.ndarray, _speed: np.ndarray) -> np.ndarray:
    """Let nothing in."""
    return np.array([0.0, 0.0, -5e4 * max(at[2], 0.0)])


def test_a_rehearsal_needs_no_learner(rig: Make) -> None:
    arm = rig(lab=bounds(link_loss="stop"))
    arm.arm.peer.linked = False
    assert "rehearsal: success" in arm.armed().printed


# -- hands on the arm ----------------------------------------------------------------------------


@pytest.mark.parametrize("mode", [Mode.GUIDING, Mode.OTHER])
@pytest.mark.parametrize("held", [False, True], ids=["ready", "paused"])
def test_who_leads_the_armed_arm_by_hand_takes_its_consent_away(
    rig: Make, mode: Mode, *, held: bool
) -> None:
    port = lying()
    arm = rig(port).armed()
    arm.arm.peer.held = held
    arm.tick()
    port.lies["mode"] = mode
    arm.tick()
    assert arm.state is State.HOLD
    port.lies.clear()
    assert arm.run(attempt()).result.kind is OutcomeKind.ABORTED
    assert arm.state is State.HOLD
    assert not arm.takes()


@pytest.mark.parametrize("looked", [True, False])
def test_an_arm_that_was_led_while_nobody_looked_does_not_move_from_there(
    rig: Make, *, looked: bool
) -> None:
    spy = Spy()
    arm = rig(spy).armed()
    arm.tick()
    spy.moves.clear()
    spy.stage.slide.x = spy.stage.slide.x + np.array([0.0, 0.05, 0.0])
    if looked:
        arm.tick()
    answer = arm.run(attempt())
    assert arm.state is State.HOLD
    assert "somebody led it" in answer.result.why
    assert spy.moves == []


def test_an_idle_arm_may_be_led_by_hand(rig: Make) -> None:
    port = lying(mode=Mode.GUIDING)
    arm = rig(port)
    arm.tick()
    assert arm.state is State.IDLE


# -- one trial at a time -------------------------------------------------------------------------


def test_step_asks_before_every_trial(rig: Make) -> None:
    arm = rig(step=True).armed()
    arm.inbox.put(answering("no"))
    assert "did not grant" in arm.run(attempt(1)).result.why
    arm.inbox.get_nowait()
    arm.inbox.put(answering("go"))
    assert arm.run(attempt(2)).result.kind is OutcomeKind.SUCCESS


def test_what_else_is_typed_at_the_question_is_done_after_it(rig: Make) -> None:
    arm = rig(step=True).armed()
    arm.inbox.put(answering("quit"))
    assert arm.run(attempt()).result.kind is OutcomeKind.ABORTED
    over = arm.arm.handle(arm.inbox.get_nowait())
    assert over is not None
    assert over.why == "ended by the operator"


def test_a_stop_typed_at_the_question_holds_the_arm(rig: Make) -> None:
    arm = rig(step=True).armed()
    arm.inbox.put(answering("stop"))
    arm.run(attempt())
    arm.arm.handle(arm.inbox.get_nowait())
    assert arm.state is State.HOLD


def test_a_robot_led_away_during_the_question_is_not_started(rig: Make) -> None:
    port = lying()
    arm = rig(port, step=True).armed()
    port.lies["mode"] = Mode.GUIDING
    arm.inbox.put(answering("go"))
    assert "somebody leads it" in arm.run(attempt()).result.why
    assert arm.state is State.HOLD


# -- words that came too early -------------------------------------------------------------------


def test_a_go_typed_before_the_question_is_no_answer_to_it(rig: Make) -> None:
    arm = rig(step=True).armed()
    arm.inbox.put(Line("go", LONG_AGO_S))
    arm.inbox.put(answering("no"))
    assert "did not grant" in arm.run(attempt()).result.why
    assert "'go' was typed before this was asked" in arm.printed


def test_a_confirmation_typed_before_the_question_arms_nothing(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy)
    arm.arm.handle(Line("confirm", LONG_AGO_S))
    assert (arm.state, spy.moves) == (State.IDLE, [])
    assert "does not count" in arm.printed
    arm.armed()


def test_a_recovery_typed_before_the_stop_recovers_nothing(rig: Make) -> None:
    arm = rig().armed()
    arm.type("stop")
    arm.arm.handle(Line("recover", LONG_AGO_S))
    held = arm.state
    arm.type("recover")
    assert (held, arm.state) == (State.HOLD, State.IDLE)


# -- what must hold before anything moves --------------------------------------------------------


def test_a_robot_that_does_not_stand_idle_is_not_armed(rig: Make) -> None:
    spy, port = Spy(), lying()
    arm = rig(port)
    port.lies["mode"] = Mode.OTHER
    arm.type("confirm")
    assert arm.state is State.FAULT
    assert "not idle" in arm.printed
    assert spy.moves == []


def test_a_tip_that_is_where_only_a_key_in_the_lock_can_be_begins_no_trial(rig: Make) -> None:
    spy = Spy()
    spy.stage = stage("hand")
    arm = rig(spy)
    arm.type("confirm")
    assert arm.state is State.FAULT
    assert "as if in the lock: free the key first" in arm.printed
    assert spy.moves == []


# -- touches and tares ---------------------------------------------------------------------------


def pressed(newton: float) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Press on the peg, wherever it is."""
    return lambda _at, _speed: np.array([0.0, 0.0, -newton])


def test_what_touches_the_tool_is_noticed_before_it_is_tared_away(rig: Make) -> None:
    arm = rig().armed()
    arm.port.slide.resistance = pressed(14.0)  # type: ignore[attr-defined]  # would pass as a tare
    assert "something touches the tool" in arm.run(attempt()).result.why
    assert arm.state is State.FAULT


def test_an_arm_that_is_leaned_on_is_not_armed(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy)
    spy.stage.slide.resistance = pressed(20.0)
    spy.stage.sample()
    arm.type("confirm")
    assert (arm.state, spy.moves) == (State.IDLE, [])
    assert "free it before it is tared" in arm.printed


def test_the_pull_of_a_jammed_key_does_not_become_zero(rig: Make, store: Store) -> None:
    store.mark_key("a stop in the lock")
    spy, zeros = Spy(), []
    arm = rig(spy)
    spy.stage.slide.resistance = pressed(14.0)
    spy.stage.sample()
    spy.interfere = lambda stage, _what: zeros.append(np.linalg.norm(stage.slide.zero))
    arm.type("confirm")
    assert zeros[0] == 0.0


# -- pauses --------------------------------------------------------------------------------------


def test_what_the_operator_paused_no_learner_resumes(rig: Make) -> None:
    arm = rig().armed()
    arm.type("pause")
    arm.tick()
    arm.arm.peer.held = False
    arm.tick()
    paused = arm.state
    arm.type("resume")
    arm.tick()
    assert (paused, arm.state) == (State.PAUSED, State.READY)
