"""The arm with its key in front of the lock, as it feels from inside the robot."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from shearline.evaluator.keylock_draw import draw_setup
from shearline.evaluator.keylock_variation import level
from shearline.sims.mujoco_plant import MujocoPlant, begin_tick, end_tick
from shearline.sims.panda import JOINTS, TORQUE_MAX, Array, rotation_z
from shearline.sims.plant import Setup, empty_percept
from shearline.sims.scene import KEY_TURN, TIP_M

#: How far the filter of the external torques goes towards the new value each millisecond.
FILTER = 0.1


class World:
    """MuJoCo behind the interface; one tick is one millisecond of the robot's clock.

    Attributes:
        now: What the arm feels at the present tick.
        tau_ext: What the surroundings do to the joints, filtered ``(7,)`` [N m].
        wrench: The wrench at the tip that best explains :attr:`tau_ext` ``(6,)`` [N, N m].
        force_n: Force on the tip in the last tick, unfiltered.
        peak_n: The largest since the arm was placed.
        travel_m: How far the tip has gone since then.
        gravity: Torques that hold the arm at rest here ``(7,)`` [N m].
    """

    def __init__(self) -> None:
        self._plant = MujocoPlant()
        self._rest = mujoco.MjData(self._plant.model)
        self._felt = np.zeros((JOINTS, 2))
        self.now = empty_percept()
        self.place(None)

    def place(self, seed: int | None) -> None:
        """Put the arm at the start; the lock where trial ``seed`` has it, or where believed."""
        setup = Setup() if seed is None else draw_setup(level("keylock"), seed)[0]
        self._plant.reset(setup)
        self.travel_m, self.peak_n, self.force_n = 0.0, 0.0, 0.0
        self._felt[:] = 0.0
        self.tau_ext, self.wrench = self._felt[:, 1], np.zeros(6)
        begin_tick(self._plant.handles, self.now)
        self.gravity = self._gravity()

    def grip(self, friction: float) -> None:
        """Have everything that touches rub so hard, as if pins had broken; until placed anew."""
        self._plant.model.geom_friction[:, 0] = friction

    def tick(self, tau: Array) -> None:
        """Go on by 1 ms under the client's torques ``tau (7,)``, without gravity [N m]."""
        now, felt = self.now, self._felt
        x, y, z = now.tip.tolist()
        limited = np.minimum(np.maximum(tau, -TORQUE_MAX), TORQUE_MAX)
        end_tick(self._plant.handles, limited + self.gravity)
        begin_tick(self._plant.handles, now)
        self.gravity = self._gravity()
        felt[:, 0] = now.contact
        felt[:, 1] += FILTER * (now.contact - felt[:, 1])
        wrenches = np.linalg.solve(now.jacobian @ now.jacobian.T, now.jacobian @ felt)
        self.wrench[:] = wrenches[:, 1]
        self.force_n = math.hypot(*wrenches[:3, 0].tolist())
        self.peak_n = max(self.peak_n, self.force_n)
        self.travel_m += math.dist((x, y, z), now.tip.tolist())

    def hold(self) -> None:
        """Stand at once, as if the brakes had closed; what presses goes on pressing."""
        self._plant.data.qvel[:] = 0.0
        self.now.dq[:] = 0.0

    def flange(self) -> Array:
        """Return the pose of the flange in the base frame ``(4, 4)``."""
        pose = np.eye(4)
        pose[:3, :3] = self.now.rotation @ _KEY_TO_FLANGE
        pose[:3, 3] = self.now.tip - pose[:3, 2] * TIP_M
        return pose

    def _gravity(self) -> Array:
        model, rest = self._plant.model, self._rest
        rest.qpos[:] = self._plant.data.qpos
        mujoco.mj_kinematics(model, rest)
        mujoco.mj_comPos(model, rest)
        mujoco.mj_comVel(model, rest)
        mujoco.mj_rne(model, rest, 0, rest.qfrc_bias)
        gravity: Array = rest.qfrc_bias[:JOINTS]
        return gravity


_KEY_TO_FLANGE = rotation_z(-KEY_TURN)
