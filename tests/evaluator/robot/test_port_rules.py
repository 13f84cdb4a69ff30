"""What both Frankas keep to whatever their library does: stops, lies, tares, free motions."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from emulator.kit import contact
from evaluator.robot.clockwork import Clockwork, limits, port
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.robot.client import COLUMNS, SPEED_STATES, Client, Drive, beyond
from shearline.evaluator.robot.errors import Ending, MotionEnded, RobotRefused
from shearline.evaluator.robot.frames import rpy
from shearline.evaluator.robot.franky import FrankyClient
from shearline.evaluator.robot.free import (
    DAMPING,
    GAIN_MPS2,
    GAIN_RADPS2,
    MASS,
    STIFFNESS,
    free_motion,
    lead,
)
from shearline.evaluator.robot.panda import PandaClient
from shearline.evaluator.robot.path import off, turned
from shearline.evaluator.robot.port import Array, log_columns


def goal(x_m: float) -> Array:
    made = np.eye(4)
    made[0, 3] = x_m
    return made


# -- stops ----------------------------------------------------------------------------------------


def test_a_stop_that_the_library_does_not_hear_at_first_brakes_all_the_same() -> None:
    client = Clockwork()
    made = port(client)
    made.contact(contact(5.0))
    client.deaf = 3  # it has begun and does not say so yet
    made.stop()
    assert client.braked.wait(5.0)


def test_nothing_is_aimed_at_once_a_stop_has_latched() -> None:
    client = Clockwork()
    made = port(client)
    session = made.contact(contact(5.0))
    session.ref(np.eye(4))
    client.brake = lambda: None  # type: ignore[method-assign]  # lost on its way
    made.stop()
    with pytest.raises(MotionEnded) as ended:
        session.ref(goal(0.001))
    assert ended.value.ending is Ending.STOPPED
    assert len(client.aims) == 1
    assert not client.running()


def test_a_stop_in_the_midst_of_a_free_motion_ends_it() -> None:
    client = Clockwork()
    made = port(client)
    client.brake = lambda: None  # type: ignore[method-assign]
    aim = client.aim

    def stopping(pose: Array) -> None:
        aim(pose)
        if len(client.aims) == 3:
            made.stop()

    client.aim = stopping  # type: ignore[method-assign]
    with pytest.raises(MotionEnded) as ended:
        made.move_free(goal(0.1), 0.1)
    assert ended.value.ending is Ending.STOPPED
    assert len(client.aims) == 3


# -- lies -----------------------------------------------------------------------------------------


@given(st.integers(0, COLUMNS - 1), st.sampled_from([np.nan, np.inf, -np.inf]))
def test_a_state_that_is_not_finite_is_beyond_every_guard(column: int, value: float) -> None:
    row = np.zeros(COLUMNS)
    drive = Drive(contact(5.0), limits(), np.zeros(13))
    assert beyond([row], drive) is None
    row[column] = value
    ended = beyond([row], drive)
    assert ended is not None
    assert ended.ending is Ending.INVALID


def test_a_free_motion_never_aims_at_what_is_no_pose() -> None:
    client = Clockwork()
    made = port(client)
    client.lie = lambda pose: pose * np.nan if len(client.aims) > 4 else pose
    with pytest.raises(MotionEnded) as ended:
        made.move_free(goal(0.001), 0.1)
    assert ended.value.ending is Ending.INVALID
    assert np.isfinite(client.aims).all()
    with pytest.raises(MotionEnded):  # it latches
        made.contact(contact(1.0))


@pytest.mark.parametrize("whose", ["start", "goal"])
def test_a_free_motion_from_or_to_nowhere_does_not_begin(whose: str) -> None:
    client = Clockwork()
    made = port(client)
    if whose == "start":
        client.lie = lambda pose: pose * np.nan
    with pytest.raises(MotionEnded) as ended:
        made.move_free(goal(np.nan if whose == "goal" else 0.01), 0.1)
    assert ended.value.ending is Ending.INVALID
    assert client.drives == []


def row_with(**felt: float) -> Array:
    """Return a state at rest in the middle of its box that feels, or is, something else."""
    row, names = np.zeros(COLUMNS), log_columns(7)
    for name, value in ({"o_t_ee.00": 1.0, "o_t_ee.11": 1.0, "o_t_ee.22": 1.0} | felt).items():
        row[names.index(name)] = value
    return row


@pytest.mark.parametrize(
    ("felt", "why"),
    [
        ({"tau_ext.3": 0.93 * 40.0}, "joint 3 felt"),
        ({"o_f_ext.fx": 60.1}, "the tip felt 60.1 N"),
        ({"o_f_ext.mz": -15.1}, "the tip felt 15.10 N m"),
        ({"o_t_ee.03": 1.1}, "the tip left its box"),
        ({"o_t_ee.23": -1.1}, "the tip left its box"),
    ],
)
def test_a_state_beyond_any_limit_of_the_guard_ends_the_contact(
    felt: dict[str, float], why: str
) -> None:
    drive = Drive(contact(5.0), limits(), np.zeros(13))
    assert beyond([row_with()], drive) is None
    ended = beyond([row_with(**felt)], drive)
    assert ended is not None
    assert ended.ending is Ending.GUARD
    assert why in str(ended)


@pytest.mark.parametrize(("speed_mps", "ends"), [(0.24, False), (0.26, True)])
def test_a_tip_that_is_too_fast_ends_the_contact(speed_mps: float, *, ends: bool) -> None:
    drive = Drive(contact(5.0), limits(), np.zeros(13))
    ticks = np.arange(SPEED_STATES + 1) * 1e-3
    rows = [row_with(**{"t_s": t_s, "o_t_ee.03": speed_mps * t_s}) for t_s in ticks]
    assert (beyond(rows, drive) is not None) is ends


def test_a_session_that_is_not_the_last_moves_nothing() -> None:
    client = Clockwork()
    made = port(client)
    first = made.contact(contact(5.0))
    made.contact(contact(5.0))
    with pytest.raises(MotionEnded, match="another contact has begun"):
        first.ref(goal(0.01))
    with pytest.raises(MotionEnded, match="another contact has begun"):
        first.gains(STIFFNESS, DAMPING)
    first.end()
    assert client.running(), "nor does it end the last one"
    assert client.aims == []


# -- tares ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("of", [2, 7, 11])
def test_a_tare_above_a_quarter_of_the_guard_is_refused_and_changes_nothing(of: int) -> None:
    client = Clockwork()
    made = port(client)
    before = made.sample()
    client.felt = client.felt.copy()
    client.felt[of] += 15.5
    with pytest.raises(RobotRefused, match="25% of the guard"):
        made.set_guard(replace(limits(), torque_max_nm=15.0))
    after = made.sample()
    felt = np.concatenate([after.tau_ext - before.tau_ext, after.o_f_ext - before.o_f_ext])
    assert felt[of] == pytest.approx(-15.5)
    made.move_free(goal(0.0), 0.1)  # the guard before still holds


def test_no_guard_is_set_while_the_arm_moves() -> None:
    client = Clockwork()
    made = port(client)
    made.contact(contact(5.0))
    with pytest.raises(RobotRefused, match="expected it at rest"):
        made.set_guard(limits())


def test_a_guard_may_be_set_without_a_tare() -> None:
    client = Clockwork()
    made = port(client)
    client.felt = client.felt + 20.0  # the key is jammed
    made.set_guard(limits(), tare=False)
    assert made.sample().o_f_ext == pytest.approx(np.full(6, -20.0))
    made.contact(contact(1.0)).end()
    assert client.drives[-1].tare == pytest.approx(np.full(13, -0.1))


# -- free motions ---------------------------------------------------------------------------------


@given(st.floats(1.0, 40.0), st.floats(0.5, 12.0), st.floats(0.01, 0.25))
def test_a_free_motion_pushes_no_harder_than_the_lab_allows_and_outruns_no_clip(
    push_n: float, twist_nm: float, speed_mps: float
) -> None:
    line, free = free_motion(np.eye(4), goal(0.05), speed_mps, limits(push_n, twist_nm))
    assert np.linalg.norm(STIFFNESS[:3] * free.clip_m) <= push_n * (1.0 + 1e-9)
    assert STIFFNESS[3] * free.clip_rad <= twist_nm * (1.0 + 1e-9)
    t_s = np.linspace(0.0, line.length_s, 200)
    x_m = [line.at(t)[0, 3] for t in t_s]
    speed = np.max(np.diff(x_m)) / (t_s[1] - t_s[0])
    assert speed <= speed_mps
    assert DAMPING[0] * speed <= STIFFNESS[0] * free.clip_m


@pytest.mark.parametrize(("far_m", "turn_rad"), [(0.012, 0.02), (0.1, 0.0), (0.0, 0.3)])
def test_an_arm_of_the_mass_that_is_reckoned_with_stays_on_its_line(
    far_m: float, turn_rad: float
) -> None:
    end = goal(far_m)
    end[:3, :3] = turned(np.array([0.0, 0.6, 0.8]), turn_rad)
    line, _ = free_motion(np.eye(4), end, 0.1, limits())
    at, speed, dt_s = np.zeros(6), np.zeros(6), 2e-3
    for tick in range(math.ceil(line.length_s / dt_s)):
        wanted = off(np.eye(4), line.at(tick * dt_s))
        assert np.abs(wanted - at)[:3].max() < 2e-4
        assert np.abs(wanted - at)[3:].max() < 2e-3
        pull = STIFFNESS * (wanted + lead(line, tick * dt_s, turning=1.0) - at)
        speed = speed + dt_s * (pull - DAMPING * speed) / MASS
        at = at + dt_s * speed


@given(st.floats(0.001, 0.2), st.floats(0.0, 0.5))
def test_a_free_motion_gains_speed_no_faster_than_it_may(far_m: float, turn_rad: float) -> None:
    end = goal(far_m)
    end[:3, :3] = turned(np.array([1.0, 0.0, 0.0]), turn_rad)
    line, _ = free_motion(np.eye(4), end, 0.25, limits())
    gains = np.array([line.rates(t)[1] for t in np.linspace(0.0, line.length_s, 100)])
    assert np.linalg.norm(gains[:, :3], axis=1).max() <= GAIN_MPS2 * (1.0 + 1e-9)
    assert np.linalg.norm(gains[:, 3:], axis=1).max() <= GAIN_RADPS2 * (1.0 + 1e-9)


# -- the clip -------------------------------------------------------------------------------------


@pytest.mark.parametrize("client", [FrankyClient(), PandaClient(1.0)], ids=["fr3", "panda"])
@given(st.tuples(*[st.floats(-1.5, 1.5)] * 3))
def test_no_client_pulls_harder_than_the_clip_along_any_axis_of_the_lock(
    client: Client, turn: tuple[float, ...]
) -> None:
    asked = replace(contact(1.0), o_r_c=rpy(turn))
    clip = client.clip(asked)
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    pulled = corners @ clip.o_r.T @ asked.o_r_c  # where the error may be, along the lock's axes
    assert np.abs(pulled).max() * clip.m <= asked.clip_m * (1.0 + 1e-9)
    assert np.abs(pulled).max() * clip.rad <= asked.clip_rad * (1.0 + 1e-9)
    along_base = client.clip(replace(asked, o_r_c=np.eye(3)))
    assert (along_base.m, along_base.rad) == (asked.clip_m, asked.clip_rad)
