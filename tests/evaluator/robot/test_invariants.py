"""What must never happen at a robot, each on real clients before an emulated robot.

The arm's process, its terminal and the worker's side of the pipe are the real ones; the stage of
the docs stands in where no client is installed. Freezing Python in a contact is a matter of the
port alone: see ``test_franka.py``.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from emulator.kit import Kind, kinds
from emulator.process import Emulator
from evaluator.robot.cell import Cell

from shearline.evaluator.robot.port import log_columns
from shearline.evaluator.robot.task import RobotDown
from shearline.evaluator.skill.manipulation import AXIAL_K
from shearline.protocol.messages import OutcomeKind

pytestmark = [pytest.mark.slow, pytest.mark.chaos]

#: A tuple that keeps pushing at the lock's face until it is told to end.
LONG = {"app_off_x": 2e-3, "app_off_y": 2e-3, "ins_speed": 0.002, "wig_a_x": 0.0, "wig_a_y": 0.0}

Make = Callable[..., Cell]


@pytest.fixture(scope="module", params=kinds())
def kind(request: pytest.FixtureRequest) -> Kind:
    chosen: Kind = request.param
    return chosen


@pytest.fixture(scope="module")
def robot(kind: Kind, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Emulator]:
    with Emulator(kind.version, tmp_path_factory.mktemp(kind.name) / "log") as emulator:
        yield emulator


@pytest.fixture
def cell(kind: Kind, robot: Emulator, tmp_path: Path) -> Make:
    """Make a cell whose robot stands at the start with nothing wrong with it."""
    robot.order("place")
    return lambda **facts: Cell(tmp_path, kind, robot, **facts)


def in_contact(cell: Cell) -> Any:
    """Begin a long trial, and return it once it is in the midst of its contact."""
    running, robot = cell.start(theta=cell.theta(**LONG)), cell.robot
    assert robot is not None
    cell.until(cell.in_contact, "contact")
    since_s = robot.report()["t_s"]
    cell.until(lambda: robot.report()["t_s"] > since_s + 0.5, "half a second of contact")
    robot.until("mode", "move")
    return running


def test_nothing_moves_before_an_operator_confirms(cell: Make) -> None:
    with cell() as idle:
        for number in range(3):
            assert "waits for its operator" in idle.start(number).aborted()
        idle.type("", "resume", "recover", "go")
        assert idle.moves() == 0


def test_what_the_bounds_do_not_allow_is_rejected_and_nothing_moves(cell: Make) -> None:
    with cell() as armed:
        armed.armed()
        before = armed.moves()
        theta = armed.theta()
        bad = (armed.theta(ins_push=20.5), armed.theta(xi=float("nan")), theta[:-1], [*theta, 1.0])
        for number, tuple_ in enumerate(bad):
            assert armed.start(number, theta=tuple_).rejected()
        assert armed.moves() == before


def test_the_arm_pushes_no_harder_than_stiffness_times_clip_whatever_the_skill_asks(
    cell: Make,
) -> None:
    """In all but a twentieth of the time: an impact, as at the lock's bottom, is no matter of it.

    The push that is asked for is more than twice what the clip lets through.
    """
    clip_m = 0.005
    with cell(lab=f"[contact]\nclip_m = {clip_m}\n") as armed:
        armed.armed()
        pushing = armed.theta(ins_push=20.0, con_speed=0.02, con_force=1.0, **{**LONG, "xi": 0.3})
        trace = armed.start(theta=pushing).outcome().trace
        assert trace is not None
        mean = np.convolve(trace.columns["wrench.fz"][1], np.ones(50) / 50, mode="valid")
        most_n = np.quantile(np.abs(mean), 0.95)
        assert 0.9 * AXIAL_K * clip_m < most_n <= 1.1 * AXIAL_K * clip_m


FAULTS: dict[str, Callable[[Cell, Emulator], object]] = {
    "user stop": lambda _cell, robot: robot.order("press"),
    "reflex": lambda _cell, robot: robot.order("startle"),
    "communication loss": lambda _cell, robot: robot.order("lose 40"),
    "TCP drop": lambda _cell, robot: robot.order("drop"),
    "frozen clock": lambda _cell, robot: robot.order("freeze"),
    "nan": lambda _cell, robot: robot.order("nan"),
    "zero wrench": lambda _cell, robot: robot.order("zero"),
    "SIGKILL": lambda cell, _robot: cell.process.send_signal(signal.SIGKILL),
    "SIGSTOP": lambda cell, _robot: cell.process.send_signal(signal.SIGSTOP),
}


def spooled(kind: Kind, fault: str) -> set[int]:
    """Return how many results the arm's process may leave: one, unless it is gone before.

    Then the worker alone says what became of the attempt. At a NaN the Panda's library throws in a
    thread of its own, which ends the process before or after the arm has answered.
    """
    if fault.startswith("SIG"):
        return {0}
    return {0, 1} if (kind.version, fault) == (5, "nan") else {1}


@pytest.mark.parametrize("fault", FAULTS)
def test_after_a_fault_nothing_moves_before_the_operator_acts_and_one_result_is_aborted(
    cell: Make, robot: Emulator, kind: Kind, fault: str
) -> None:
    with cell() as armed:
        armed.armed()
        running = in_contact(armed)
        FAULTS[fault](armed, robot)
        assert running.aborted()
        moved = robot.report()["moves"]
        for number in range(1, 4):
            armed.start(number).aborted()
        assert robot.report()["moves"] == moved
        assert not armed.ready.is_set()
        results = [r for r in armed.spooled() if r.trial == 0]
        assert all(r.kind is OutcomeKind.ABORTED for r in results)
        assert len(results) in spooled(kind, fault)
        assert armed.in_contact()
    robot.order("thaw")


def test_releasing_the_stop_button_moves_nothing(cell: Make, robot: Emulator) -> None:
    with cell() as armed:
        armed.armed()
        running = in_contact(armed)
        robot.order("press")
        assert running.aborted()
        robot.order("release")
        before = robot.report()
        end_s = before["t_s"] + 5.0
        armed.until(lambda: robot.report()["t_s"] >= end_s, "five seconds of the robot's")
        after = robot.report()
        assert (after["moves"], armed.stands()) == (before["moves"], "hold")
        assert after["travel_m"] - before["travel_m"] < 1e-3


def test_a_stopped_arm_goes_on_after_recover_and_confirm_and_pulls_the_key_out_first(
    cell: Make, robot: Emulator
) -> None:
    with cell() as armed:
        armed.armed()
        running = in_contact(armed)
        robot.order("press")
        assert running.aborted()
        robot.order("release")
        armed.until(lambda: armed.stands() == "hold", "hold")
        armed.type("recover")
        armed.until(lambda: armed.stands() == "idle", "idle")
        armed.armed()
        assert not armed.in_contact()
        assert armed.start(7).outcome().extras["depth_m"] > 0.0


def test_a_trial_from_another_start_pose_is_aborted(cell: Make) -> None:
    off = cell()
    shown = off.state / "calibration.json"
    pose = msgspec.json.decode(shown.read_bytes())
    pose["o_t_lock"][11] += 0.05  # the lock is said to be higher: the tip is in it already
    shown.write_bytes(msgspec.json.encode(pose))
    with off:
        off.type("confirm")
        off.until(lambda: off.stands() == "fault", "fault")
        assert "free the key first" in off.diary()
        assert off.moves() == 0


def test_the_same_attempt_twice_is_one_motion_and_the_same_answer(cell: Make) -> None:
    with cell() as armed:
        armed.armed()
        first = armed.start().outcome()
        before = armed.moves()
        again = armed.start().outcome()
        assert (again.cost, again.digest) == (first.cost, first.digest)
        assert armed.moves() == before


def test_a_key_in_the_lock_survives_kill_9_and_is_pulled_out_at_the_next_start(
    cell: Make, robot: Emulator
) -> None:
    broken = cell()
    with broken:
        broken.armed()
        running = in_contact(broken)
        broken.process.send_signal(signal.SIGKILL)
        assert running.aborted()
    assert broken.in_contact()
    broken.ready.clear()
    robot.until("client", value=False)
    if robot.report()["mode"] == "reflex":  # by itself, for want of a client
        with pytest.raises(RobotDown, match="expected idle"), broken:
            pass
        assert broken.in_contact()
        robot.order("desk")
        robot.until("mode", "idle")
        broken.ready.clear()
    with broken:
        broken.armed()
        assert '"cause": "extract"' in broken.diary()
        assert not broken.in_contact()


def test_a_key_that_the_lock_grips_jams_the_arm_with_the_gripper_closed(
    cell: Make, robot: Emulator
) -> None:
    with cell() as armed:
        armed.armed()
        running = armed.start(theta=armed.theta(ins_speed=0.005))
        armed.until(lambda: robot.report()["depth_m"] > 0.01, "a key half in")
        robot.order("grip 50")
        assert running.outcome().success is False
        armed.until(lambda: armed.stands() == "jammed", "jammed")
        assert robot.report()["depth_m"] > 0.005
        assert armed.in_contact()
        moved = robot.report()["moves"]
        for number in (1, 2):
            armed.start(number).aborted()
        armed.type("confirm")
        assert robot.report()["moves"] == moved


def test_a_trial_goes_on_when_the_learner_is_lost_and_its_result_waits(cell: Make) -> None:
    with cell() as armed:
        armed.armed()
        running = armed.start()
        armed.until(armed.in_contact, "contact")
        armed.linked = False
        outcome = running.outcome()
        (kept,) = armed.spooled()
        assert (kept.cost, kept.digest) == (outcome.cost, outcome.digest)
        assert not armed.in_contact()
        armed.task.spool.drop(kept.token)
        assert armed.spooled() == []


def test_a_stopped_trial_leaves_its_whole_log(cell: Make, robot: Emulator) -> None:
    with cell() as armed:
        armed.armed()
        running = in_contact(armed)
        robot.order("press")
        assert running.aborted()
        armed.until(lambda: list((armed.state / "logs").glob("*.npy")), "a log")
        (path,) = (armed.state / "logs").glob("*.npy")
        log = np.load(path)
        assert log.shape[1] == len(log_columns(7))
        t_s = log[:, 0]
        np.testing.assert_allclose(np.diff(t_s[-100:]), 1e-3, atol=1e-6)


@pytest.mark.long
def test_twenty_trials_lose_no_cycle(cell: Make, robot: Emulator) -> None:
    robot.order("pace lockstep 1")
    with cell() as armed:
        armed.armed()
        for number in range(20):
            outcome = armed.start(number).outcome()
            assert outcome.trace is not None
            assert outcome.extras["depth_m"] > -1.0
        assert robot.report()["lost"] == 0
