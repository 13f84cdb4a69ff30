"""The PyBullet plant keeps the plant's contract, and means by each word what MuJoCo means."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from shearline.sims.bullet_plant import BulletPlant
from shearline.sims.bullet_world import BulletSettings
from shearline.sims.lock import Lock
from shearline.sims.mujoco_plant import MujocoPlant
from shearline.sims.panda import DAMPING, JOINTS, Array
from shearline.sims.plant import Percept, Plant, PlantError, Setup, empty_percept
from shearline.sims.scene import Q_START, START_GAP_M, Scene, believed_lock_pose

#: Torques that set every joint in motion [N m].
_KICK = np.array([3.0, -2.0, 1.0, 2.0, -0.5, 0.4, 0.3])


@pytest.fixture(scope="module")
def plant() -> BulletPlant:
    return BulletPlant()


def _felt(plant: Plant, setup: Setup) -> Percept:
    percept = empty_percept()
    plant.reset(setup)
    plant.sense(percept)
    return percept


def _kicked(plant: Plant, ticks: int) -> Array:
    """Push all joints, in free space; return angles and speeds ``(2, 7)``."""
    percept = _felt(plant, Setup())
    for _ in range(ticks):
        plant.step(percept.bias + _KICK)
        plant.sense(percept)
    return np.array([percept.q, percept.dq])


def test_the_tip_starts_in_front_of_the_mouth(plant: BulletPlant) -> None:
    percept = _felt(plant, Setup())
    np.testing.assert_allclose(percept.in_lock, [0.0, 0.0, -START_GAP_M], atol=1e-12)


def test_a_lock_that_is_off_is_felt_in_its_own_frame(plant: BulletPlant) -> None:
    off = np.array([2e-3, -1e-3, 3e-3])
    percept = _felt(plant, Setup(lock=believed_lock_pose().moved(off, np.zeros(3))))
    np.testing.assert_allclose(percept.in_lock, [-2e-3, 1e-3, -START_GAP_M - 3e-3], atol=1e-12)


def test_an_arm_that_carries_itself_stays_where_it_is_and_feels_nothing(plant: BulletPlant) -> None:
    percept = _felt(plant, Setup())
    for _ in range(200):
        plant.step(percept.bias)
        plant.sense(percept)
    np.testing.assert_allclose(percept.q, Q_START, atol=1e-6)
    np.testing.assert_allclose(percept.contact, 0.0, atol=1e-3)


def test_the_arm_is_as_heavy_as_in_mujoco_rotors_and_all(plant: BulletPlant) -> None:
    ours, theirs = _kicked(plant, 40), _kicked(MujocoPlant(), 40)
    assert np.abs(theirs[1]).min() > 1e-3
    np.testing.assert_allclose(ours[1], theirs[1], rtol=5e-3, atol=1e-6)


def test_a_free_arm_feels_no_contact_however_it_moves(plant: BulletPlant) -> None:
    _kicked(plant, 40)
    percept = empty_percept()
    plant.sense(percept)
    assert np.abs(percept.dq).max() > 0.1
    np.testing.assert_allclose(percept.contact, 0.0, atol=1e-2)


def test_a_pin_at_rest_stays_at_rest(plant: BulletPlant) -> None:
    percept = _felt(plant, Setup())
    for _ in range(100):
        plant.step(percept.bias)
        plant.sense(percept)
    np.testing.assert_allclose(percept.pins, 0.0, atol=1e-6)


def test_two_trials_on_one_plant_are_one_trial_on_two_plants(plant: BulletPlant) -> None:
    _kicked(plant, 7)
    np.testing.assert_array_equal(_kicked(plant, 30), _kicked(BulletPlant(), 30))


def test_two_plants_in_one_process_do_not_meet(plant: BulletPlant) -> None:
    other, percept = BulletPlant(), empty_percept()
    _felt(plant, Setup())
    _kicked(other, 20)
    plant.sense(percept)
    np.testing.assert_array_equal(percept.dq, 0.0)


def test_a_state_that_is_not_physical_ends_the_trial_without_a_verdict(plant: BulletPlant) -> None:
    percept = _felt(plant, Setup())
    with pytest.raises(PlantError, match="no longer physical"):
        plant.step(percept.bias + 1e6)


def test_what_is_not_a_number_ends_the_trial_too(plant: BulletPlant) -> None:
    _felt(plant, Setup())
    with pytest.raises(PlantError, match="no longer physical"):
        plant.step(np.full(JOINTS, np.nan))


def test_the_engine_changes_with_model_and_settings(plant: BulletPlant) -> None:
    assert plant.engine == f"pybullet 3.2.7 model {plant.model_hash}"
    finer = BulletPlant(settings=BulletSettings(substeps=2))
    wider = BulletPlant(Scene(lock=Lock(clearance_x_m=0.1e-3)))
    assert len({plant.model_hash, finer.model_hash, wider.model_hash}) == 3


def test_joint_friction_is_felt_as_motion_and_not_as_contact(plant: BulletPlant) -> None:
    """At speed v the known friction d v is no part of what the surroundings do."""
    percept = _felt(plant, Setup())
    for _ in range(100):
        plant.step(percept.bias + _KICK)
        plant.sense(percept)
    assert DAMPING * np.abs(percept.dq).max() > 0.1
    np.testing.assert_allclose(percept.contact, 0.0, atol=1e-2)


def test_the_engine_says_nothing_of_itself() -> None:
    program = "from shearline.sims.bullet_world import bullet; bullet(); print('data')"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert (done.stdout, done.stderr) == ("data\n", "")
