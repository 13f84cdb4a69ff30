"""The arm's machine on the simulated stage: trials, the key, wear, and the worker's wishes."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest
from evaluator.robot.rig import (
    O_T_LOCK,
    Rig,
    Spy,
    answering,
    attempt,
    bounds,
    lying,
    stage,
    theta,
)

from shearline.evaluator.robot import pipe
from shearline.evaluator.robot.errors import Ending, MotionEnded
from shearline.evaluator.robot.peer import Gone
from shearline.evaluator.robot.spool import Spool
from shearline.evaluator.robot.states import State
from shearline.evaluator.robot.store import Store
from shearline.evaluator.robot.terminal import Closed
from shearline.protocol.messages import OutcomeKind

Make = Callable[..., Rig]


def test_a_trial_succeeds_with_the_cost_and_names_of_the_simulated_one(rig: Make) -> None:
    arm = rig().armed()
    answer = arm.run(attempt())
    result = answer.result
    assert (result.kind, result.why) == (OutcomeKind.SUCCESS, "")
    assert 0.0 < result.cost < 5.0
    assert result.extras["depth_m"] >= 24.5e-3
    assert result.cost == pytest.approx(result.extras["insertion_s"])
    assert bounds().hash in result.engine
    assert arm.state is State.READY
    assert not arm.store.key_in_lock


def test_a_failure_bears_the_name_it_has_in_simulation(rig: Make) -> None:
    answer = rig().armed().run(attempt(theta=theta(app_off_x=2e-3, wig_a_x=0.0, ins_push=0.0)))
    assert answer.result.kind is OutcomeKind.FAILURE
    assert answer.result.why in {"roi", "time", "search", "torque"}
    assert answer.result.cost > 5.0


def test_the_trace_is_the_robots_log_at_one_kilohertz(rig: Make) -> None:
    trace = rig().armed().run(attempt()).trace
    assert trace is not None
    columns = np.frombuffer(trace.data, "<f4").reshape(len(trace.names), trace.samples)
    np.testing.assert_allclose(np.diff(columns[0]), 1e-3, atol=2e-4)
    named = dict(zip(trace.names, columns, strict=True))
    assert named["depth"].max() >= 24.5e-3
    assert [name for _, name in trace.events][-1] in {"extraction", "success"}


@pytest.mark.parametrize("bad", [theta(ins_push=21.0), theta(xi=float("nan")), [0.0] * 22])
def test_what_the_bounds_do_not_allow_is_rejected_and_nothing_moves(
    rig: Make, bad: list[float]
) -> None:
    spy = Spy()
    arm = rig(spy).armed()
    spy.moves.clear()
    answer = arm.run(attempt(theta=bad))
    assert answer.result.kind is OutcomeKind.REJECTED
    assert spy.moves == []


def test_the_same_attempt_twice_is_one_motion_and_the_same_answer(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy).armed()
    first = arm.run(attempt())
    spy.moves.clear()
    assert arm.run(attempt()) == first
    assert spy.moves == []


def test_a_contact_that_the_guard_ended_for_its_box_is_no_failure_of_the_tuple(rig: Make) -> None:
    assert strayed(rig, {"o_t_ee": outside()}) == (OutcomeKind.ABORTED, "the tip left its box")
    assert strayed(rig, {}) == (OutcomeKind.FAILURE, "torque"), "while for force it is one"


def outside() -> np.ndarray:
    at = O_T_LOCK.copy()
    at[0, 3], at[2, 3] = 0.5, 0.15  # beside the box, and not in the lock
    return at


def strayed(rig: Make, lies: dict[str, Any]) -> tuple[OutcomeKind, str]:
    """Have the guard end a contact while the robot says so of itself; return the verdict."""
    port = lying()
    arm = rig(port).armed()
    aim, refs = port.ref, itertools.count()

    def ref(pose: np.ndarray) -> None:
        if next(refs) == 20:
            port.end()
            port.lies.update(lies)
            port.ended = MotionEnded(Ending.GUARD, "the tip left its box")
        aim(pose)

    port.ref = ref
    ran = arm.run(attempt()).result
    return ran.kind, ran.why


def test_a_trial_from_which_this_computer_was_away_is_no_measurement(rig: Make) -> None:
    port = lying()
    arm = rig(port).armed()
    aim, refs = port.ref, itertools.count()

    def ref(pose: np.ndarray) -> None:
        aim(pose)
        if next(refs) == 20:
            for _ in range(300):
                port.sample()

    port.ref = ref
    result = arm.run(attempt()).result
    assert result.kind is OutcomeKind.ABORTED
    assert "this computer was away for 0.3" in result.why
    assert not arm.store.key_in_lock


# -- the key -------------------------------------------------------------------------------------


def test_a_key_that_may_be_in_the_lock_is_pulled_out_first(rig: Make, store: Store) -> None:
    store.mark_key("kill -9")
    arm = rig(stage("hand"))
    assert "it will first pull the key out" in arm.printed
    arm.type("confirm")
    assert arm.state is State.READY
    assert arm.port.sample().o_t_ee[2, 3] > 0.1
    assert not store.key_in_lock


def test_the_marker_is_on_disk_before_the_key_can_be_in_the_lock(rig: Make) -> None:
    seen: list[bool] = []
    spy = Spy()
    arm = rig(spy)
    spy.interfere = lambda _stage, what: seen.append(arm.store.key_in_lock or what == "move_free")
    arm.armed().run(attempt())
    assert all(seen)


def test_a_key_that_does_not_come_out_jams_the_arm_and_stays_known(
    rig: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = rig().armed()
    monkeypatch.setattr(arm.port.slide, "resistance", _glued)  # type: ignore[attr-defined]
    arm.run(attempt())
    assert arm.state is State.JAMMED
    assert arm.store.key_in_lock
    assert not arm.takes()


def _glued(at: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Let the peg in, and not out again."""
    return np.array([0.0, 0.0, 60.0 if at[2] > 0.005 and speed[2] < 1e-3 else 0.0])


# -- wear and canary -----------------------------------------------------------------------------


def test_key_and_lock_are_worn_after_their_insertions(rig: Make) -> None:
    lab = bounds(wear=msgspec.structs.replace(bounds().wear, key_insertions=2))
    arm = rig(lab=lab).armed()  # the rehearsal is the first
    assert arm.run(attempt(1)).result.kind is OutcomeKind.SUCCESS
    assert (arm.state, arm.takes()) == (State.WORN, False)
    assert "peg-1 has done 2 insertions of 2" in arm.run(attempt(2)).result.why
    arm.type("recover", "confirm")
    assert arm.state == State.WORN
    arm.type("replaced key")
    arm.armed()
    assert arm.store.wear().insertions == {"peg-1": 1, "hole-1": 3}


def canaries(arm: Rig) -> list[str]:
    """Return how each canary ended, as the diary has it."""
    diary = (arm.store.folder / "diary.jsonl").read_text().splitlines()
    entries = [json.loads(line) for line in diary]
    return [entry["verdict"] for entry in entries if entry["what"] == "canary"]


def every(trials: int) -> Any:
    """Return bounds with a canary after so many trials."""
    return bounds(canary=msgspec.structs.replace(bounds().canary, every=trials))


def test_a_canary_is_tried_every_so_many_trials_and_told_to_no_learner(rig: Make) -> None:
    arm = rig(lab=every(2)).armed()
    for number in range(5):
        assert arm.run(attempt(number)).result.kind is OutcomeKind.SUCCESS
    answers = [said for said in arm.said if isinstance(said, pipe.Answer)]
    assert len(answers) == 5
    assert canaries(arm) == ["success", "success"]


def test_a_canary_runs_after_the_answer_and_the_worker_hears_before_it_that_no_trial_may_come(
    rig: Make,
) -> None:
    arm = rig(lab=every(1)).armed()
    arm.said.clear()
    arm.run(attempt())
    kinds = [said.takes if isinstance(said, pipe.Stands) else "answer" for said in arm.said]
    at = kinds.index("answer")
    assert kinds[at - 1 : at + 2] == [False, "answer", False], "the canary's approach comes last"
    assert kinds[-1] is True
    assert arm.run(attempt(1)).result.kind is OutcomeKind.SUCCESS, "who came all the same"


def test_a_canary_that_fails_again_and_again_means_worn(rig: Make) -> None:
    arm = rig(lab=every(1)).armed()
    arm.port.slide.resistance = lambda at, _speed: np.array([0, 0, -5e4 * max(at[2], 0.0)])  # type: ignore[attr-defined]
    assert arm.run(attempt()).result.kind is OutcomeKind.FAILURE, "the trial's own verdict"
    assert (arm.state, arm.takes()) == (State.WORN, False)
    assert "the canary failed" in arm.printed
    assert len(canaries(arm)) == 2
    answer = arm.run(attempt(1))
    assert (answer.result.kind, arm.state) == (OutcomeKind.ABORTED, State.WORN)


def test_a_canary_without_a_verdict_is_tried_again_and_then_a_fault(
    rig: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = rig(lab=every(1)).armed()

    def lacking(*_: object) -> int:
        return 3 if any(isinstance(said, pipe.Answer) for said in arm.said) else 0

    monkeypatch.setattr("shearline.evaluator.robot.motions.missing", lacking)
    arm.run(attempt())
    assert arm.state is State.FAULT
    assert canaries(arm) == ["the robot's log lacks 3 cycles of the contact"] * 2


def test_nothing_is_tried_when_the_worker_wants_to_leave(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy, lab=every(1)).armed()
    spy.interfere = lambda _stage, _what: setattr(arm.arm.peer, "leaving", "the run has ended")
    arm.run(attempt())
    assert canaries(arm) == []
    assert arm.state is State.READY


def test_a_canary_waits_while_the_learner_holds(rig: Make) -> None:
    arm = rig(lab=every(1)).armed()
    arm.arm.peer.held = True
    arm.run(attempt())
    assert (arm.state, canaries(arm)) == (State.PAUSED, [])
    arm.arm.peer.held = False
    arm.tick()
    assert (arm.state, canaries(arm), arm.takes()) == (State.READY, ["success"], True)


def test_in_step_mode_the_operator_is_asked_for_the_canary_too(rig: Make) -> None:
    arm = rig(lab=every(1), step=True).armed()
    for _ in range(2):
        arm.inbox.put(answering("go"))
    assert arm.run(attempt()).result.kind is OutcomeKind.SUCCESS
    assert canaries(arm) == ["success"]
    assert "the canary: type 'go'" in arm.printed


# -- the worker ----------------------------------------------------------------------------------


def test_a_hold_pauses_the_arm_and_a_resume_ends_that(rig: Make) -> None:
    arm = rig().armed()
    arm.arm.peer.held = True
    arm.tick()
    assert (arm.state, arm.takes()) == (State.PAUSED, False)
    arm.arm.peer.held = False
    arm.tick()
    assert (arm.state, arm.takes()) == (State.READY, True)


def test_a_wish_to_stop_ends_the_trial_and_brings_the_key_out(rig: Make) -> None:
    spy = Spy()
    arm = rig(spy).armed()
    asked = attempt()

    def wish(_stage: Any, what: str) -> None:
        if what == "ref":
            arm.arm.peer.halts[asked.trial.token] = "the run was stopped"

    spy.interfere = wish
    answer = arm.run(asked)
    assert (answer.result.kind, answer.result.why) == (OutcomeKind.ABORTED, "the run was stopped")
    assert arm.state is State.READY
    assert not arm.store.key_in_lock


@pytest.mark.parametrize(
    ("policy", "kind"), [("finish", OutcomeKind.SUCCESS), ("stop", OutcomeKind.ABORTED)]
)
def test_a_trial_whose_learner_is_out_of_reach_is_finished_or_stopped_as_the_lab_says(
    rig: Make, policy: str, kind: OutcomeKind
) -> None:
    spy = Spy()
    arm = rig(spy, lab=bounds(link_loss=policy)).armed()

    def cut(_stage: Any, _what: str) -> None:
        arm.arm.peer.linked = False

    spy.interfere = cut
    answer = arm.run(attempt())
    assert answer.result.kind is kind
    assert arm.state is State.READY
    assert not arm.store.key_in_lock
    assert Spool(arm.store.folder / "spool").pending("run-1") == [answer.result]


@pytest.mark.parametrize("item", [Gone(), Closed(), pipe.Leave(why="the worker leaves")])
def test_the_arm_ends_when_the_worker_or_the_terminal_is_gone(rig: Make, item: object) -> None:
    arm = rig().armed()
    over = arm.arm.handle(item)
    assert over is not None
    assert over.code == 0
    assert arm.state is State.OFFLINE


def test_no_message_of_the_pipe_arms_recovers_or_widens_anything() -> None:
    names = {kind.__name__ for kind in pipe.ToArm.__args__}
    assert names == {"Try", "Stop", "Look", "Leave"}
    fields = {f for kind in pipe.ToArm.__args__ for f in kind.__struct_fields__}
    assert fields == {"run", "trial", "token", "why", "linked", "held"}
