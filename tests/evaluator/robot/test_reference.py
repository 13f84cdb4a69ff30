"""Commands of the skill as references of the robot's controller."""

from __future__ import annotations

import numpy as np
import pytest
from evaluator.robot.rig import O_T_LOCK, bounds
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.robot.frames import in_lock, is_pose
from shearline.evaluator.robot.port import Clip
from shearline.evaluator.robot.reference import (
    Reference,
    contact_of,
    damping_of,
    stiffness_of,
    target_of,
)
from shearline.evaluator.robot.sight import turn_of
from shearline.evaluator.skill.manipulation import AXIAL_K, Command, empty_command

DT_S = 0.005


def command(**changes: list[float]) -> Command:
    """Return a command that holds all but the axis, as in an insertion."""
    c = empty_command()
    c.stiffness[:] = [500.0, 500.0, 0.0, 50.0, 50.0, 50.0]
    c.ratio[0] = 0.7
    for name, values in changes.items():
        getattr(c, name)[:] = values
    return c


def test_a_push_becomes_the_displacement_that_pushes_as_hard_at_rest() -> None:
    c = command(x=[1e-3, 0.0, 0.02], wrench=[5.0, 0.0, 15.0, 0.5, 0.0, 0.0])
    target = target_of(c, speed_z=0.0)
    pull = stiffness_of(c) * (target - [*c.x, *c.turn])
    np.testing.assert_allclose(pull, c.wrench)
    assert stiffness_of(c)[2] == AXIAL_K


def test_the_reference_leads_by_what_the_robot_takes_off_in_motion() -> None:
    c = command(x=[0.0, 0.0, 0.02], wrench=[0.0, 0.0, 15.0, 0.0, 0.0, 0.0], v=[0.01, 0.0, 0.03])
    stiffness, speed = stiffness_of(c), np.array([0.01, 0.0, 0.02, 0.0, 0.0, 0.0])
    pull = stiffness * (target_of(c, speed_z=0.02) - [*c.x, *c.turn])
    np.testing.assert_allclose(pull - damping_of(c) * speed, c.wrench)


def test_above_its_speed_the_skill_pushes_less() -> None:
    c = command(wrench=[0.0, 0.0, 15.0, 0.0, 0.0, 0.0], v=[0.0, 0.0, 0.02], drag=[0.0, 0.0, 300.0])
    assert target_of(c, 0.05)[2] < target_of(command(wrench=list(c.wrench)), 0.05)[2]


def test_a_contact_has_the_labs_clip_and_the_locks_axes() -> None:
    contact = contact_of(command(), O_T_LOCK, bounds(), 3.0)
    assert (contact.clip_m, contact.t_max_s) == (0.02, 3.0)
    np.testing.assert_array_equal(contact.o_r_c, O_T_LOCK[:3, :3])


@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6), st.floats(0.05, 1.0))
def test_a_reference_never_moves_faster_than_it_may(goal: list[float], pace: float) -> None:
    reference, limits = Reference(bounds(), pace), bounds().contact
    reference.begin(np.zeros(3), np.zeros(3))
    before = reference.pose(np.eye(4))
    for _ in range(5):
        reference.toward(np.array(goal), np.zeros(3), np.zeros(3), DT_S)
        after = reference.pose(np.eye(4))
        step = np.linalg.norm(after[:3, 3] - before[:3, 3])
        assert step <= pace * limits.reference_mps * DT_S * (1.0 + 1e-9)
        assert is_pose(after)
        before = after


@pytest.mark.parametrize(
    ("axis", "within", "beyond"), [(0, 0.019, 0.021), (3, 0.049, 0.051)], ids=["force", "torque"]
)
def test_what_the_clip_takes_away_is_counted(axis: int, within: float, beyond: float) -> None:
    reference = Reference(bounds(), 1.0)
    for asked in (within, beyond):
        target = np.eye(6)[axis] * asked
        reference.begin(target[:3], target[3:])  # there already: no speed is in the way
        reference.toward(target, np.zeros(3), np.zeros(3), DT_S)
    assert reference.clipped_share == pytest.approx(0.5)


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.tuples(*[st.floats(-0.02, 0.02)] * 3))
def test_on_a_turned_lock_what_is_counted_is_what_the_robot_clips_along_its_own_axes(
    turn: tuple[float, ...], asked_m: tuple[float, ...]
) -> None:
    o_t_lock = in_lock(np.eye(4), (0.0, 0.0, 0.0), turn)
    reference, clip = Reference(bounds(), 1.0), Clip(np.eye(3), 0.01, 0.02)
    reference.reckon_with(clip, o_t_lock)
    target = np.array([*asked_m, 0.0, 0.0, 0.0])
    reference.begin(target[:3], target[3:])
    reference.toward(target, np.zeros(3), np.zeros(3), DT_S)
    in_base_m = o_t_lock[:3, :3] @ asked_m
    assert reference.clipped_share == float((np.abs(in_base_m) > clip.m).any())


@pytest.mark.parametrize(("axis", "speed"), [(0, 0.2), (4, 1.0)], ids=["m/s", "rad/s"])
def test_what_the_references_speed_takes_away_is_counted(axis: int, speed: float) -> None:
    reference = Reference(bounds(), 1.0)
    for asked in (0.9 * speed * DT_S, 1.1 * speed * DT_S):
        reference.begin(np.zeros(3), np.zeros(3))
        reference.toward(np.eye(6)[axis] * asked, np.zeros(3), np.zeros(3), DT_S)
    assert reference.clipped_share == pytest.approx(0.5)


@given(st.tuples(*[st.floats(-0.7, 0.7)] * 3))
def test_a_turn_is_read_back_as_it_was_commanded(turn: tuple[float, ...]) -> None:
    placed = in_lock(np.eye(4), (0.0, 0.0, 0.0), turn)
    np.testing.assert_allclose(turn_of(placed[:3, :3]), turn, atol=1e-9)
