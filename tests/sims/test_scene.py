"""Where things stand, and that the text of the model says so."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.sims.lock import Lock
from shearline.sims.mujoco_plant import MujocoPlant
from shearline.sims.panda import Array, rotation_x, rotation_y, rotation_z
from shearline.sims.scene import (
    Q_START,
    START_GAP_M,
    Scene,
    Settings,
    believed_lock_pose,
    quaternion,
    tip_pose,
)

_ANGLE = st.floats(-3.2, 3.2)


def _from_quaternion(q: Array) -> Array:
    w, v = q[0], q[1:]
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    matrix: Array = np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
    return matrix


@given(a=_ANGLE, b=_ANGLE, c=_ANGLE)
def test_a_quaternion_gives_its_rotation_back(a: float, b: float, c: float) -> None:
    rotation = rotation_z(c) @ rotation_y(b) @ rotation_x(a)
    np.testing.assert_allclose(_from_quaternion(quaternion(rotation)), rotation, atol=1e-12)


def test_the_tool_points_straight_down_at_the_start() -> None:
    np.testing.assert_allclose(tip_pose(Q_START).rotation[:, 2], [0.0, 0.0, -1.0], atol=1e-12)


def test_the_lock_is_believed_in_front_of_the_tip() -> None:
    gap = believed_lock_pose().position - tip_pose(Q_START).position
    np.testing.assert_allclose(gap, [0.0, 0.0, -START_GAP_M], atol=1e-12)


def test_the_model_comes_out_as_it_was_found_to_converge() -> None:
    option = MujocoPlant().model.opt
    assert option.timestep == 5e-4
    assert option.impratio == 10.0
    assert (option.integrator, option.cone, option.jacobian, option.solver) == (3, 1, 0, 2)


def test_a_tick_is_a_whole_number_of_steps() -> None:
    assert Settings().substeps == 2
    assert Settings(timestep_s=125e-6).substeps == 8


@pytest.mark.parametrize(
    "scene", [Scene(lock=Lock(friction=0.3)), Scene(settings=Settings(timestep_s=2.5e-4))]
)
def test_any_change_of_the_scene_changes_its_hash(scene: Scene) -> None:
    assert MujocoPlant(scene).model_hash != MujocoPlant().model_hash


def test_no_mesh_and_no_sphere_takes_part_in_contact() -> None:
    model = MujocoPlant().model
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    assert set(model.geom_type[touching].tolist()) == {3, 6}  # capsule, box
