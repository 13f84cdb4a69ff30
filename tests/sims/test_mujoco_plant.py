"""The MuJoCo plant keeps the plant's contract."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shearline.sims.lock import PINS
from shearline.sims.mujoco_plant import MujocoPlant
from shearline.sims.plant import Percept, PlantError, Setup, empty_percept
from shearline.sims.scene import Q_START, START_GAP_M, believed_lock_pose


@pytest.fixture(scope="module")
def plant() -> MujocoPlant:
    return MujocoPlant()


def _felt(plant: MujocoPlant, setup: Setup) -> Percept:
    percept = empty_percept()
    plant.reset(setup)
    plant.sense(percept)
    return percept


def test_the_jacobian_is_the_engines(plant: MujocoPlant) -> None:
    percept = _felt(plant, Setup(q=(0.1, 0.3, -0.2, -1.9, 0.3, 2.0, 0.4)))
    expected = np.zeros((6, plant.model.nv))
    site = plant.model.site("tip").id
    mujoco.mj_jacSite(plant.model, plant.data, expected[:3], expected[3:], site)
    np.testing.assert_allclose(percept.jacobian, expected[:, :7], atol=1e-14)


def test_the_tip_starts_in_front_of_the_mouth(plant: MujocoPlant) -> None:
    percept = _felt(plant, Setup())
    np.testing.assert_allclose(percept.in_lock, [0.0, 0.0, -START_GAP_M], atol=1e-12)


def test_a_lock_that_is_off_is_felt_in_its_own_frame(plant: MujocoPlant) -> None:
    off = np.array([2e-3, -1e-3, 3e-3])
    percept = _felt(plant, Setup(lock=believed_lock_pose().moved(off, np.zeros(3))))
    np.testing.assert_allclose(percept.in_lock, [-2e-3, 1e-3, -START_GAP_M - 3e-3], atol=1e-12)


def test_an_arm_that_carries_itself_stays_where_it_is(plant: MujocoPlant) -> None:
    percept = _felt(plant, Setup())
    for _ in range(200):
        plant.step(percept.bias)
        plant.sense(percept)
    np.testing.assert_allclose(percept.q, Q_START, atol=1e-9)
    np.testing.assert_array_equal(percept.contact, 0.0)


def test_a_reset_undoes_the_friction_and_springs_of_the_trial_before(plant: MujocoPlant) -> None:
    plant.reset(Setup())
    friction, stiffness = plant.model.geom_friction.copy(), plant.model.jnt_stiffness.copy()
    plant.reset(Setup(friction=0.4, pin_scale=(0.7, 0.8, 1.0, 1.2, 1.3)))
    assert plant.model.geom_friction[:, 0].tolist() == [0.4] * plant.model.ngeom
    assert plant.model.jnt_stiffness[7] == pytest.approx(0.7 * stiffness[7])
    plant.reset(Setup())
    np.testing.assert_array_equal(plant.model.geom_friction, friction)
    np.testing.assert_array_equal(plant.model.jnt_stiffness, stiffness)


def test_a_pin_pushed_in_gives_preload_and_spring_force(plant: MujocoPlant) -> None:
    lock = plant.scene.lock
    plant.reset(Setup())
    plant.data.qpos[7:] = 1e-3
    mujoco.mj_forward(plant.model, plant.data)
    expected = -(lock.pin_preload_n + lock.pin_stiffness * 1e-3)
    np.testing.assert_allclose(plant.data.qfrc_spring[7:], [expected] * PINS, rtol=1e-9)


def test_a_state_that_is_not_physical_ends_the_trial_without_a_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    plant = MujocoPlant()
    percept = _felt(plant, Setup())
    plant.data.qvel[:7] = 1e12
    plant.sense(percept)
    with pytest.raises(PlantError, match="no longer physical"):
        plant.step(percept.bias)
    assert not list(tmp_path.iterdir())  # MuJoCo left to itself writes a log here


def test_the_engine_names_version_and_model(plant: MujocoPlant) -> None:
    assert plant.engine == f"mujoco {mujoco.__version__} model {plant.model_hash}"


def test_friction_slips_at_the_edge_of_the_cone() -> None:
    """A block of the same contact settings on a slope: holds below mu, slides above it."""
    for slope, slides in ((0.24, False), (0.26, True)):
        model = mujoco.MjModel.from_xml_string(f"""<mujoco>
<option timestep="5e-4" integrator="implicitfast" cone="elliptic" solver="Newton"
 jacobian="dense" impratio="10" gravity="{9.81 * slope} 0 -9.81"/>
<default><geom condim="3" friction=".25 .005 .0001" solref=".002 1"
 solimp=".95 .99 .0001 .5 2"/></default>
<worldbody><geom type="box" pos="0 0 -.05" size="1 1 .05"/>
<body pos="0 0 .01"><freejoint/><geom type="box" size=".02 .02 .01" mass=".1"/></body>
</worldbody></mujoco>""")
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 1000)
        # Sliding: a t^2 / 2 with a = g (slope - mu) is 12 mm after .5 s.
        assert (data.qpos[0] > 6e-3) == slides
