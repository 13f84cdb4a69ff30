"""Proofs that the simulated trial can be trusted: step size, penetration, energy.

    python -m shearline.evaluator.skill.physics --tuples 50 --trials 1000

prints one JSON object. The tests run short versions of the same functions.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator

import mujoco
import numpy as np

from shearline.evaluator.base import Array
from shearline.evaluator.keylock import BulletKeylockTask, KeylockTask
from shearline.evaluator.keylock_draw import draw_setup
from shearline.evaluator.keylock_variation import level
from shearline.evaluator.plants import DEFAULT, PLANTS
from shearline.sims.mujoco_plant import MujocoPlant
from shearline.sims.panda import JOINTS, LINKS, link_offset, rotation_x
from shearline.sims.plant import Setup, empty_percept
from shearline.sims.scene import KEY_TURN, Scene, Settings, tip_pose

#: Step of the reference that the default step is compared with [s].
REFERENCE_STEP_S = 125e-6


def random_tuples(task: KeylockTask | BulletKeylockTask, count: int, seed: int = 0) -> Array:
    """Return tuples ``(count, 23)``, uniform over the task's bounds."""
    bounds = np.array([(low, high) for _, low, high in task.spec.space.values()])
    uniform = np.random.default_rng(seed).uniform(size=(count, len(bounds)))
    tuples: Array = bounds[:, 0] + uniform * (bounds[:, 1] - bounds[:, 0])
    return tuples


def verdict_agreement(tuples: int, step_s: float = Settings().timestep_s) -> float:
    """Return the share of random tuples with the verdict that the reference step gives."""
    tasks = [
        KeylockTask(scene=Scene(settings=Settings(timestep_s=step)))
        for step in (step_s, REFERENCE_STEP_S)
    ]
    same = 0
    for seed, theta in enumerate(random_tuples(tasks[0], tuples)):
        one, other = (task.run(theta, seed, lambda: None).success for task in tasks)
        same += one == other
    return same / tuples


def penetrations(
    trials: int, first_seed: int = 0, task: KeylockTask | BulletKeylockTask | None = None
) -> Iterator[tuple[float, float]]:
    """Yield how deep the blade was in the walls of the keyway, for each trial [m].

    Measured from the geometry of the trace, not from the solver's own account: positive where a
    corner of the blade, or an edge where it enters the straight part of the keyway, is beyond a
    wall.

    Yields:
        The deepest along x and along y.
    """
    task = task or KeylockTask()
    for i, theta in enumerate(random_tuples(task, trials, first_seed)):
        setup, _ = draw_setup(level("keylock"), first_seed + i)
        _, rows = task.execute(setup, task.job(theta), lambda: None)
        yield penetration(task.plant.scene, setup, rows)


def penetration(scene: Scene, setup: Setup, rows: Array) -> tuple[float, float]:
    """Return the deepest penetration along x and y in one trace [m]; see :func:`penetrations`."""
    lock, key = scene.lock, scene.lock.key
    start = 4 * JOINTS
    tip = rows[:, start : start + 3]
    inside = tip[:, 2] > lock.chamfer_m + 0.5e-3
    if not inside.any():
        return 0.0, 0.0
    tip = tip[inside]
    turn = setup.lock.rotation.T @ key_rotations(rows[inside, :JOINTS])
    half = np.array([key.thickness_m / 2.0, key.height_m / 2.0])
    signs = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
    corners = np.concatenate([signs * half, np.zeros((4, 1))], axis=1)
    front = tip[:, None, :] + np.einsum("nij,cj->nci", turn, corners)
    back = (front[:, :, 2] - lock.chamfer_m) / turn[:, None, 2, 2]
    mouth = front - back[:, :, None] * turn[:, None, :, 2]
    beyond = np.maximum(np.abs(front), np.abs(mouth)).max(axis=(0, 1))
    return float(beyond[0] - lock.half_x_m), float(beyond[1] - lock.half_y_m)


def key_rotations(q: Array) -> Array:
    """Return the key's rotations ``(n, 3, 3)`` in the base frame at joint angles ``(n, 7)``."""
    rotation = np.tile(np.eye(3), (len(q), 1, 1))
    for j, link in enumerate(LINKS):
        rotation = rotation @ rotation_x(link.alpha) @ _about_z(q[:, j])
    return rotation @ _about_z(np.full(len(q), KEY_TURN))


def energy_drift(duration_s: float = 0.35, kick: float = 0.3) -> float:
    """Return the relative change of the arm's energy while it swings freely.

    Gravity on, no friction, no control, no contact; the default integrator and step. The scale is
    the largest kinetic energy on the way.

    Args:
        duration_s: For how long it swings [s]; after .4 s it falls onto a joint limit.
        kick: Initial speed of all joints [rad/s].
    """
    plant = MujocoPlant()
    plant.reset(Setup())
    model, data = plant.model, plant.data
    model.dof_damping[:] = 0.0
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data.qvel[:JOINTS] = kick
    mujoco.mj_forward(model, data)
    start, largest = float(data.energy.sum()), 0.0
    for _ in range(round(duration_s / model.opt.timestep)):
        mujoco.mj_step(model, data)
        largest = max(largest, float(data.energy[1]))
    mujoco.mj_forward(model, data)
    return abs(float(data.energy.sum()) - start) / largest


def gravity_error(q: Array) -> float:
    """Return how far the torque that holds the arm is from the gradient of its height [N m].

    The gradient is taken by central differences of the potential energy of the published masses.
    """
    plant = MujocoPlant()
    plant.reset(Setup(q=tuple(float(angle) for angle in q)))
    percept = empty_percept()
    plant.sense(percept)
    step = 1e-6
    gradient = [
        (_potential(plant, q + step * axis) - _potential(plant, q - step * axis)) / (2.0 * step)
        for axis in np.eye(JOINTS)
    ]
    return float(np.abs(percept.bias - np.array(gradient)).max())


def _potential(plant: MujocoPlant, q: Array) -> float:
    """Return m g h of all links, hand and key, by our own kinematics of the links' centres [J]."""
    height, position, rotation = 0.0, np.zeros(3), np.eye(3)
    for link, angle in zip(LINKS, q, strict=True):
        position = position + rotation @ np.array(link_offset(link))
        rotation = rotation @ rotation_x(link.alpha) @ _about_z(np.array([angle]))[0]
        height += link.mass * (position + rotation @ np.array(link.centre))[2]
    tip = tip_pose(q)
    for name in ("hand", "key"):
        body = plant.model.body(name)
        frame = rotation @ _rotation(body.quat)
        height += body.mass[0] * (position + rotation @ body.pos + frame @ body.ipos)[2]
    assert abs(tip.position[2] - (position + rotation @ plant.model.body("key").pos)[2]) < 1e-12
    return 9.81 * float(height)


def _rotation(quat: Array) -> Array:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)


def _about_z(angle: Array) -> Array:
    rotation = np.zeros((len(angle), 3, 3))
    rotation[:, 0, 0] = rotation[:, 1, 1] = np.cos(angle)
    rotation[:, 1, 0] = np.sin(angle)
    rotation[:, 0, 1] = -rotation[:, 1, 0]
    rotation[:, 2, 2] = 1.0
    return rotation


def main(arguments: list[str] | None = None) -> int:
    """Print the proofs as one JSON object and return an exit code."""
    parser = argparse.ArgumentParser(description="Prove the physics of the key-in-lock task.")
    parser.add_argument("--tuples", type=int, default=50, help="tuples to compare step sizes with")
    parser.add_argument("--plant", choices=PLANTS, default=DEFAULT, help="measure penetration on")
    parser.add_argument("--trials", type=int, default=1000, help="trials to measure penetration in")
    options = parser.parse_args(arguments)
    task = BulletKeylockTask() if options.plant == "pybullet" else KeylockTask()
    deep = np.array(list(penetrations(options.trials, task=task)))
    lock = Scene().lock
    found = {
        "verdict_agreement": verdict_agreement(options.tuples),
        "penetration_x_um": [float(np.median(deep[:, 0])) * 1e6, float(deep[:, 0].max()) * 1e6],
        "penetration_y_um": [float(np.median(deep[:, 1])) * 1e6, float(deep[:, 1].max()) * 1e6],
        "clearance_x_um": lock.clearance_x_m * 1e6,
        "clearance_y_um": lock.clearance_y_m * 1e6,
        "energy_drift": energy_drift(),
    }
    sys.stdout.write(json.dumps(found) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
