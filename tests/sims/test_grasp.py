"""The grasp: pads as stiff as their formulas say, in the model and under load."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shearline.sims.grasp import GRIP_M, Grasp, rubber
from shearline.sims.mujoco_plant import MujocoPlant
from shearline.sims.panda import JOINTS
from shearline.sims.plant import PlantError, Setup, empty_percept
from shearline.sims.scene import Q_START, Scene, key_in_hand, tip_pose


def test_pads_twist_and_bend_with_about_the_same_stiffness() -> None:
    twist, bend = rubber().stiffness
    assert twist == pytest.approx(4.77, abs=0.01)
    assert bend == pytest.approx(4.41, abs=0.01)


def test_a_sideways_force_at_the_tip_turns_the_key_as_far_as_the_springs_allow() -> None:
    mujoco = pytest.importorskip("mujoco")
    plant = MujocoPlant(Scene(grasp=rubber()))
    plant.reset(Setup(pad_scale=0.5))
    model, data = plant.model, plant.data
    mujoco.mj_forward(model, data)
    model.opt.gravity[:] = 0.0
    force_n, key = 2.0, model.body("key").id
    tip = data.site("tip").xpos.copy()
    along_y = data.site("tip").xmat.reshape(3, 3)[:, 1]
    for _ in range(2000):
        data.qpos[:JOINTS], data.qvel[:JOINTS] = Q_START, 0.0  # the arm stands still
        data.qfrc_applied[:] = 0.0
        mujoco.mj_applyFT(model, data, force_n * along_y, np.zeros(3), tip, key, data.qfrc_applied)
        mujoco.mj_step(model, data)
    expected = force_n * GRIP_M / (0.5 * rubber().stiffness[0])
    assert abs(data.qpos[JOINTS]) == pytest.approx(expected, rel=0.02)


def test_a_rigid_grasp_has_no_joints_and_puts_the_key_where_it_sits() -> None:
    plant = MujocoPlant(Scene(grasp=Grasp()))
    assert plant.model.nv == MujocoPlant().model.nv
    percept = empty_percept()
    plant.reset(Setup(grip=(0.0, 1e-4, -2e-4, 0.0, 0.0, 0.0)))
    plant.sense(percept)
    assert percept.tip == pytest.approx(tip_pose(Q_START).position, abs=1e-9)
    assert percept.in_lock == pytest.approx([0.0, 1e-4, -15e-3 - 2e-4], abs=1e-9)


def test_a_key_that_is_one_with_the_hand_cannot_sit_off() -> None:
    with pytest.raises(PlantError, match="expected a scene with a grasp"):
        MujocoPlant().reset(Setup(grip=(0.0, 1e-4, 0.0, 0.0, 0.0, 0.0)))


def test_the_turn_is_about_the_middle_of_the_grip() -> None:
    turned = key_in_hand((0.0, 0.0, 0.0, math.radians(90.0), 0.0, 0.0))
    nominal = key_in_hand()
    assert np.linalg.norm(turned.position - nominal.position) == pytest.approx(
        math.sqrt(2.0) * GRIP_M
    )
