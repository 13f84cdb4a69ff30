"""Both Frankas through their real client libraries, against a robot that is emulated."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from emulator.kit import (
    OPERATOR,
    STIFFNESS,
    Kind,
    contact,
    guard,
    press,
    tool,
    wait,
)
from emulator.process import Emulator

from shearline.evaluator.robot.errors import (
    Ending,
    MotionEnded,
    RobotRefused,
    RobotUnreachable,
)
from shearline.evaluator.robot.frames import apart
from shearline.evaluator.robot.port import LOG_STEP_S, Array, Mode

pytestmark = pytest.mark.slow

#: Beside the keyway, where the tip meets the face of the lock [m], in its own frame.
FACE = np.array([2e-3, 0.0, 0.03])


@pytest.fixture
def port(kind: Kind, robot: Emulator) -> Iterator[Any]:
    """A port that is open, guarded and tared; the robot has nothing wrong with it."""
    robot.order("place")
    made = kind.led(robot.address)
    made.open(tool())
    made.set_guard(guard())
    yield made
    made.close()


def above(port: Any, by_m: float) -> Array:
    goal: Array = port.sample().o_t_ee.copy()
    goal[2, 3] += by_m
    return goal


def ending(session: Any, port: Any, patience_s: float = 10.0) -> MotionEnded:
    """Go on setting the same reference until the contact is over, and return how."""
    pose = port.sample().o_t_ee
    deadline = time.monotonic() + patience_s
    while time.monotonic() < deadline:
        try:
            session.ref(pose)
            port.sample()
        except MotionEnded as ended:
            return ended
        time.sleep(2e-3)
    raise AssertionError(f"the contact goes on after {patience_s} s")


# -- motions --------------------------------------------------------------------------------------


def test_a_free_motion_of_30_mm_ends_within_a_fifth_of_a_millimetre(
    port: Any, robot: Emulator
) -> None:
    goal = above(port, 0.03)
    port.move_free(goal, 0.1)
    off_m, off_rad = apart(goal, port.sample().o_t_ee)
    assert off_m < 2e-4
    assert off_rad < 1e-3
    assert robot.report()["mode"] == "idle"


def test_a_free_motion_never_exceeds_its_speed_and_its_log_lacks_no_millisecond(
    port: Any, robot: Emulator
) -> None:
    port.drain_log()
    port.move_free(above(port, 0.03), 0.1)
    report = robot.report()
    log = port.drain_log()
    motion = report["ended"][-1]
    moving = log[(log[:, 0] > motion["began_s"]) & (log[:, 0] < motion["ended_s"])]
    assert np.allclose(np.diff(moving[:, 0]), LOG_STEP_S)
    assert len(moving) * LOG_STEP_S > motion["ended_s"] - motion["began_s"] - 0.02
    tip = moving[::10, [32, 36, 40]]
    assert np.linalg.norm(np.diff(tip, axis=0), axis=1).max() < 0.1 * 10 * LOG_STEP_S
    assert report["lost"] == 0


def test_the_force_at_rest_is_stiffness_times_clip(port: Any, robot: Emulator) -> None:
    port.set_guard(guard(60.0))
    start = port.sample().o_t_ee
    beside = start.copy()
    beside[:3, 3] += start[:3, :3] @ (FACE * (1.0, 1.0, 0.0))
    port.move_free(beside, 0.1)
    session = port.contact(contact(30.0, clip_m=0.01))
    press(port, session, start[:3, 3] + start[:3, :3] @ FACE, 0.02)
    wait(port, 0.3)
    expected = STIFFNESS[2] * 0.01
    assert robot.report()["force_n"] == pytest.approx(expected, rel=0.05)
    felt = start[:3, :3].T @ port.sample().o_f_ext[:3]
    assert felt[2] == pytest.approx(-expected, rel=0.05), "the surroundings push back"
    session.end()


def test_a_contact_begins_where_the_arm_stands(port: Any, robot: Emulator) -> None:
    before = robot.report()
    session = port.contact(contact(5.0))
    wait(port, 0.1)
    session.end()
    after = robot.report()
    assert np.linalg.norm(np.subtract(after["tip_m"], before["tip_m"])) < 1e-4
    assert after["ended"][-1]["how"] == "finished"


def test_a_contact_ends_by_itself_after_its_time(port: Any, robot: Emulator) -> None:
    session = port.contact(contact(0.5))
    assert ending(session, port).ending is Ending.TIME
    motion = robot.report()["ended"][-1]
    assert 0.4 < motion["ended_s"] - motion["began_s"] < 0.5 + 0.2
    port.contact(contact(5.0)).end()  # nothing is latched


def test_a_contact_that_meets_the_guard_ends_and_does_not_latch(port: Any) -> None:
    port.set_guard(guard(10.0))
    start = port.sample().o_t_ee
    beside = start.copy()
    beside[:3, 3] += start[:3, :3] @ (FACE * (1.0, 1.0, 0.0))
    port.move_free(beside, 0.1)
    session = port.contact(contact(30.0))
    press(port, session, start[:3, 3] + start[:3, :3] @ (FACE - (0.0, 0.0, 0.016)), 0.02)
    with pytest.raises(MotionEnded) as ended:
        press(port, session, start[:3, 3] + start[:3, :3] @ FACE, 0.004)
    assert ended.value.ending is Ending.GUARD
    port.contact(contact(5.0)).end()


# -- what goes wrong ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("order", "expected", "mode"),
    [("press", Ending.USER_STOP, Mode.USER_STOPPED), ("startle", Ending.REFLEX, Mode.REFLEX)],
)
def test_after_a_stop_nothing_moves_until_an_operator_has_recovered_the_robot(
    port: Any, robot: Emulator, order: str, expected: Ending, mode: Mode
) -> None:
    session = port.contact(contact(10.0))
    robot.order(order)
    assert ending(session, port).ending is expected
    assert port.sample().mode is mode
    moves = robot.order("release")["moves"]
    for _ in range(2):
        with pytest.raises(MotionEnded) as ended:
            port.contact(contact(1.0))
        assert ended.value.ending is expected
    goal = above(port, 0.01)
    with pytest.raises(MotionEnded):
        port.move_free(goal, 0.1)
    assert robot.report()["moves"] == moves
    port.recover(OPERATOR)
    assert port.sample().mode is Mode.IDLE
    assert robot.report()["moves"] == moves
    port.move_free(above(port, 0.005), 0.1)


def test_a_robot_whose_button_is_still_pressed_does_not_recover(port: Any, robot: Emulator) -> None:
    session = port.contact(contact(10.0))
    robot.order("press")
    ending(session, port)
    with pytest.raises(RobotRefused, match="stop button"):
        port.recover(OPERATOR)


def test_a_slow_recovery_is_waited_for(port: Any, robot: Emulator) -> None:
    session = port.contact(contact(10.0))
    robot.order("startle")
    ending(session, port)
    robot.order("recovery 0.5")
    port.recover(OPERATOR)
    assert port.sample().mode is Mode.IDLE


def test_stop_brakes_from_any_thread_and_latches(port: Any, robot: Emulator) -> None:
    session = port.contact(contact(10.0))
    thread = threading.Thread(target=port.stop)
    thread.start()
    assert ending(session, port).ending is Ending.STOPPED
    thread.join()
    port.stop()
    assert robot.until("mode", "idle")["ended"][-1]["how"] in {"stopped", "finished"}
    with pytest.raises(MotionEnded):
        port.contact(contact(1.0))
    port.recover(OPERATOR)
    port.contact(contact(5.0)).end()


def test_a_dropped_connection_is_a_lost_link_and_recovery_connects_again(
    port: Any, robot: Emulator
) -> None:
    session = port.contact(contact(10.0))
    robot.order("drop")
    assert ending(session, port).ending is Ending.LINK
    moves = robot.report()["moves"]
    with pytest.raises(MotionEnded):
        port.contact(contact(1.0))
    assert robot.report()["moves"] == moves
    port.recover(OPERATOR)
    port.move_free(above(port, 0.005), 0.1)


def test_a_clock_that_stands_is_seen_to_stand_and_does_not_hang_the_port(
    port: Any, robot: Emulator
) -> None:
    wait(port, 0.05)
    robot.order("freeze")
    time.sleep(0.05)
    stood = {port.sample().t_s for _ in range(5)}
    assert len(stood) <= 2
    with pytest.raises(MotionEnded) as ended:
        port.contact(contact(1.0))
    assert ended.value.ending is Ending.INVALID
    robot.order("thaw")


@pytest.mark.parametrize(("order", "is_lie"), [("nan", np.isnan), ("zero", lambda f: f == 0.0)])
def test_lies_are_passed_on_as_they_are(
    port: Any, robot: Emulator, order: str, is_lie: Any
) -> None:
    assert not is_lie(port.sample().o_f_ext).all()
    robot.order(order)
    wait(port, 0.05)
    assert is_lie(port.sample().o_f_ext).all()


def test_the_tare_takes_the_sensors_bias_away(port: Any, robot: Emulator) -> None:
    robot.order("bias 3 -4 5")
    wait(port, 0.05)
    assert np.linalg.norm(port.sample().o_f_ext[:3]) > 5.0
    port.set_guard(guard())
    wait(port, 0.05)
    assert np.linalg.norm(port.sample().o_f_ext[:3]) < 0.5


def test_what_is_too_much_to_be_a_bias_is_not_tared_away(port: Any, robot: Emulator) -> None:
    robot.order("bias 6 -7 8")
    wait(port, 0.05)
    with pytest.raises(RobotRefused, match="free the tool"):
        port.set_guard(guard())
    wait(port, 0.05)
    assert np.linalg.norm(port.sample().o_f_ext[:3]) > 10.0
    port.set_guard(guard(), tare=False)
    assert np.linalg.norm(port.sample().o_f_ext[:3]) > 10.0


def test_a_robot_that_lies_in_a_free_motion_ends_it_and_latches(
    kind: Kind, port: Any, robot: Emulator
) -> None:
    if kind.version == 5:
        pytest.skip("libfranka itself ends the process there: its low-pass filter throws")
    goal, ended = above(port, 0.03), []

    def lie() -> None:
        robot.until("mode", "move")
        robot.order("nan")

    liar = threading.Thread(target=lie)
    liar.start()
    try:
        port.move_free(goal, 0.02)
    except MotionEnded as how:
        ended.append(how.ending)
    liar.join()
    assert ended == [Ending.INVALID]
    moves = robot.report()["moves"]
    with pytest.raises(MotionEnded):
        port.contact(contact(1.0))
    assert robot.report()["moves"] == moves


@pytest.mark.parametrize("lag_s", [0.0, 0.005, 0.02])
def test_a_stop_while_a_contact_only_begins_is_not_lost(
    port: Any, robot: Emulator, lag_s: float
) -> None:
    begins = port._client.begin

    def stopped(drive: Any) -> None:
        late = threading.Timer(lag_s, port.stop)
        late.start()
        begins(drive)

    port._client.begin = stopped
    try:
        ended = ending(port.contact(contact(10.0)), port)
    except MotionEnded as at_once:
        ended = at_once
    assert ended.ending is Ending.STOPPED
    assert robot.until("mode", "idle")["travel_m"] < 5e-3


# -- refusals -------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["other", "guiding"])
def test_a_robot_that_is_not_idle_is_refused(kind: Kind, robot: Emulator, mode: str) -> None:
    robot.order("place")
    robot.order(f"mode {mode}")
    with pytest.raises(RobotRefused, match="expected idle"):
        kind.make(robot.address).open(tool())
    assert robot.report()["moves"] == 0


def test_a_robot_of_another_version_is_refused(kind: Kind, robot: Emulator) -> None:
    robot.order("place")
    robot.order("version 7")
    with pytest.raises(RobotRefused, match="version"):
        kind.make(robot.address).open(tool())


def test_an_address_where_nobody_listens_is_unreachable(kind: Kind) -> None:
    with pytest.raises(RobotUnreachable, match=r"127\.9\.9\.9"):
        kind.make("127.9.9.9").open(tool())


def test_a_tool_lighter_than_the_robots_own_hand_is_refused(kind: Kind, robot: Emulator) -> None:
    robot.order("place")
    light = tool()
    with pytest.raises(RobotRefused, match="correct the one or the other"):
        kind.make(robot.address).open(type(light)(light.f_t_ee, 0.1, light.centre_m))


def test_nothing_moves_before_limits_were_set(kind: Kind, robot: Emulator) -> None:
    robot.order("place")
    made = kind.make(robot.address)
    made.open(tool())
    with pytest.raises(RobotRefused, match="set_guard"):
        made.contact(contact(1.0))
    assert robot.report()["moves"] == 0
    made.close()


# -- pace -----------------------------------------------------------------------------------------


def test_in_lockstep_a_busy_machine_loses_no_cycle(port: Any, robot: Emulator) -> None:
    spin = [sys.executable, "-c", "while True: pass"]
    busy = [subprocess.Popen(spin) for _ in range(2)]
    try:
        port.drain_log()
        session = port.contact(contact(10.0))
        wait(port, 0.5)
        session.end()
    finally:
        for process in busy:
            process.kill()
            process.wait()
    assert robot.report()["lost"] == 0
    assert np.allclose(np.diff(port.drain_log()[-400:, 0]), LOG_STEP_S)


def test_a_few_lost_states_are_survived_and_many_are_not(port: Any, robot: Emulator) -> None:
    session = port.contact(contact(20.0))
    wait(port, 0.05)
    robot.order("lose 5")
    wait(port, 0.1)
    assert robot.report()["mode"] == "move"
    robot.order("lose 25")
    assert ending(session, port).ending is Ending.REFLEX
    assert "communication_constraints_violation" in port.sample().errors
