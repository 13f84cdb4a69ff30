"""The impedance controller against its equations, on the simulated arm in free space."""

from __future__ import annotations

import numpy as np
import pytest

from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.skill.control import DESIGN_MASS, Arm, arm, control, empty_feel, feel
from shearline.evaluator.skill.manipulation import Command, empty_command
from shearline.sims.panda import Array
from shearline.sims.plant import Setup, empty_percept
from shearline.sims.scene import TICK_S, believed_lock_pose


@pytest.fixture
def panda() -> Arm:
    return arm(believed_lock_pose(), TICK_S)


def _hold(x: tuple[float, float, float], turn: tuple[float, float, float]) -> Command:
    c = empty_command()
    c.x[:], c.turn[:] = x, turn
    c.stiffness[:] = (1000.0, 1500.0, 2000.0, 100.0, 100.0, 100.0)
    c.ratio[0] = 1.0
    return c


def _settle(task: KeylockTask, panda: Arm, c: Command, ticks: int) -> tuple[Array, list[Array]]:
    percept, f, torques = empty_percept(), empty_feel(), []
    task.plant.reset(Setup())
    for i in range(ticks):
        task.plant.sense(percept)
        if i == 0:
            f.tau[:] = percept.bias
        feel(f, percept, panda)
        control(f, percept, c, panda)
        torques.append(f.tau.copy())
        task.plant.step(f.tau)
    axes = panda.axes.T @ percept.rotation
    turn = np.array([axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]])
    return np.concatenate([f.tip, turn / 2.0]), torques


def test_the_arm_comes_to_rest_where_it_is_told(task: KeylockTask, panda: Arm) -> None:
    goal = (4e-3, -3e-3, -20e-3)
    pose, _ = _settle(task, panda, _hold(goal, (0.0, 0.0, 0.05)), 2000)
    np.testing.assert_allclose(pose[:3], goal, atol=2e-5)
    np.testing.assert_allclose(pose[3:], [0.0, 0.0, np.sin(0.05)], atol=1e-3)


@pytest.mark.parametrize("axis", range(3))
def test_a_constant_force_gives_way_by_force_over_stiffness(
    task: KeylockTask, panda: Arm, axis: int
) -> None:
    c = _hold((0.0, 0.0, -15e-3), (0.0, 0.0, 0.0))
    c.wrench[axis] = 5.0
    pose, _ = _settle(task, panda, c, 2000)
    moved = pose[axis] - c.x[axis]
    assert moved == pytest.approx(5.0 / c.stiffness[axis], rel=0.01)


def test_torques_keep_the_limits_of_the_arm(task: KeylockTask, panda: Arm) -> None:
    c = _hold((0.3, 0.3, -0.3), (0.0, 0.0, 0.0))
    _, torques = _settle(task, panda, c, 60)
    tau = np.array(torques)
    assert np.all(np.abs(tau) <= panda.torque_max)
    assert np.abs(np.diff(tau, axis=0)).max() <= 1.0 + 1e-12
    assert np.abs(tau[-1]).max() > 20.0  # the limits were reached for


def test_the_null_space_does_not_move_the_tip(task: KeylockTask, panda: Arm) -> None:
    still = _hold((0.0, 0.0, -15e-3), (0.0, 0.0, 0.0))
    pulled = panda._replace(q_rest=panda.q_rest + np.array([0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 0.0]))
    pose, _ = _settle(task, pulled, still, 1500)
    np.testing.assert_allclose(pose[:3], still.x, atol=2e-4)


def test_the_external_torque_follows_a_step_with_its_time_constant(
    task: KeylockTask, panda: Arm
) -> None:
    percept, f = empty_percept(), empty_feel()
    task.plant.reset(Setup())
    task.plant.sense(percept)
    percept.contact[:] = 10.0
    ticks = round(1.0 / (2.0 * np.pi * 15.0) / TICK_S)
    for _ in range(ticks):
        feel(f, percept, panda)
    assert f.tau_ext[0] == pytest.approx(10.0 * (1.0 - np.exp(-1.0)), rel=0.05)


def test_the_wrench_is_the_force_at_the_tip(task: KeylockTask, panda: Arm) -> None:
    percept, f = empty_percept(), empty_feel()
    task.plant.reset(Setup())
    task.plant.sense(percept)
    felt = np.array([1.0, -2.0, -7.0, 0.1, 0.2, -0.3])
    world = np.kron(np.eye(2), panda.axes) @ felt
    percept.contact[:] = percept.jacobian.T @ world
    for _ in range(200):
        feel(f, percept, panda)
    np.testing.assert_allclose(f.wrench, felt, atol=1e-3)


def test_the_damping_is_designed_for_this_arm(task: KeylockTask) -> None:
    percept = empty_percept()
    task.plant.reset(Setup())
    mass = task.plant.mass_matrix()
    task.plant.sense(percept)
    turn = np.kron(np.eye(2), believed_lock_pose().rotation.T)
    jacobian = turn @ percept.jacobian
    mobility = np.diag(jacobian @ np.linalg.solve(mass, jacobian.T))
    np.testing.assert_allclose(1.0 / mobility, DESIGN_MASS, rtol=0.05)
