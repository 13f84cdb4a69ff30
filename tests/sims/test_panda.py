"""The arm's numbers: our own kinematics against the engine's, gravity against energy."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.sims import panda
from shearline.sims.mujoco_plant import MujocoPlant
from shearline.sims.scene import tip_pose

_ANGLES = st.tuples(*(st.floats(*link.range_rad) for link in panda.LINKS))


@pytest.fixture(scope="module")
def plant() -> MujocoPlant:
    return MujocoPlant()


@given(q=_ANGLES)
@settings(max_examples=30, deadline=None)
def test_our_forward_kinematics_are_the_engines(plant: MujocoPlant, q: tuple[float, ...]) -> None:
    plant.data.qpos[:7] = q
    mujoco.mj_kinematics(plant.model, plant.data)
    site = plant.model.site("tip").id
    pose = tip_pose(np.array(q))
    np.testing.assert_allclose(plant.data.site_xpos[site], pose.position, atol=1e-12)
    np.testing.assert_allclose(plant.data.site_xmat[site].reshape(3, 3), pose.rotation, atol=1e-12)


def test_the_arm_weighs_what_was_identified() -> None:
    assert sum(link.mass for link in panda.LINKS) == pytest.approx(16.062, abs=1e-3)


def test_every_inertia_could_belong_to_a_body() -> None:
    for link in panda.LINKS:
        xx, yy, zz, xy, xz, yz = link.inertia
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert moments[0] > 0.0
        assert moments[2] <= (moments[0] + moments[1]) * 1.01, link.name


def test_limits_are_the_published_ones() -> None:
    assert panda.TORQUE_MAX.tolist() == [87.0] * 4 + [12.0] * 3
    assert np.all(panda.RANGE[:, 0] < panda.RANGE[:, 1])
