"""The key-in-lock scene in PyBullet, tick by tick.

Bullet collides, solves contacts and moves. What a percept needs beyond joint states comes from
:mod:`shearline.sims.dynamics`: the same arm, quicker to ask. Pads between key and fingers, like the
springs of the pins, are torques set before each step. Contact torques on the joints are what
is missing in the equations of motion between two steps; since Bullet moves by semi-implicit Euler,
that is exact. Knows no skill.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import itertools

import numpy as np

from shearline.sims.bullet_world import BulletSettings, BulletWorld, converged
from shearline.sims.compiled import compiled
from shearline.sims.dynamics import Chain, chain, forward, inverse
from shearline.sims.hinge import Hinge
from shearline.sims.hold import hold
from shearline.sims.lock import PINS
from shearline.sims.panda import ARMATURE, DAMPING, JOINTS, Array
from shearline.sims.plant import Percept, PlantError, Setup
from shearline.sims.scene import Scene

#: Several times what the arm's joints can do [rad/s].
SPEED_MAX = 20.0


class BulletPlant:
    """One simulated arm in front of one lock.

    Args:
        scene: What to simulate; its own settings are MuJoCo's.
        settings: How Bullet is to solve it; the default is the one shown to be converged.
    """

    def __init__(self, scene: Scene | None = None, settings: BulletSettings | None = None) -> None:
        self.scene = scene or Scene()
        self.settings = settings or converged(self.scene)
        self.world = BulletWorld(self.scene, self.settings)
        described = repr((self.world.files, self.settings)).encode()
        self.model_hash = hashlib.sha256(described).hexdigest()[:12]
        self._nominal = self._arm = chain(self.scene)
        self._setup = Setup()
        joints = JOINTS + self.scene.grip_joints
        self._states = np.zeros((self.settings.substeps + 1, 3, joints))
        self._hinges: tuple[Hinge, ...] = ()
        self._stiffness = self._pins = [0.0] * PINS
        self._contact = np.zeros(JOINTS)
        self._ticks = 0

    @property
    def engine(self) -> str:
        """Engine, version and the hash of the model and of how it is solved."""
        return f"pybullet {importlib.metadata.version('pybullet')} model {self.model_hash}"

    def reset(self, setup: Setup) -> None:
        """Go to the start of a trial, at rest.

        Raises:
            PlantError: If the key is to sit off in a scene in which it is one with the hand.
        """
        held = hold(self.scene, setup, self.settings.timestep_s)
        self.world.build(setup, held)
        self._arm = chain(self.scene, held)
        self._hinges = () if held is None else held.hinges
        self._setup, self._ticks = setup, 0
        self._stiffness = [self.scene.lock.pin_stiffness * scale for scale in setup.pin_scale]
        self._contact[:] = 0.0
        self._read(self._states[-1])

    def sense(self, percept: Percept) -> None:
        """Fill ``percept`` with the present."""
        lock, now = self._setup.lock, self._states[-1]
        _perceive(
            self._nominal, self._arm, now, self._contact, lock.position, lock.rotation, percept
        )
        percept.pins[:] = self._pins

    def step(self, tau: Array) -> None:
        """Apply ``tau (7,)`` [N m] for one tick."""
        torques, states = tau.tolist(), self._states
        states[0] = states[-1]
        for before, after in itertools.pairwise(states):
            self.world.step(torques + self._pads(before), self._springs())
            self._read(after)
        _find_missing(self._arm, states, tau, self.settings.timestep_s, self._contact)
        self._ticks += 1
        if not np.abs(states[-1, 1, :JOINTS]).max() < SPEED_MAX:
            raise PlantError(
                f"a joint turned faster than {SPEED_MAX:g} rad/s in tick {self._ticks}:"
                " the simulation is no longer physical, the trial has no verdict"
            )

    def _pads(self, state: Array) -> list[float]:
        """Return the torques between hand and key [N m]."""
        turned = state[:2, JOINTS:].tolist()
        return [hinge.torque(*now) for hinge, *now in zip(self._hinges, *turned, strict=True)]

    def _springs(self) -> list[float]:
        """Return the forces on the pins [N]."""
        bent_m = self.scene.lock.pin_preload_n / self.scene.lock.pin_stiffness
        return [-k * (y + bent_m) for k, y in zip(self._stiffness, self._pins, strict=True)]

    def _read(self, state: Array) -> None:
        self.world.arm(state)
        self._pins = self.world.pins()


@compiled
def _perceive(
    nominal: Chain,
    arm: Chain,
    state: Array,
    contact: Array,
    lock: Array,
    axes: Array,
    percept: Percept,
) -> None:
    """Fill all of a percept but the pins."""
    joints = state.shape[1]
    true_tip, turn, jacobian = np.empty(3), np.empty((3, 3)), np.empty((6, joints))
    bias = np.empty(joints)
    percept.q[:] = state[0, :JOINTS]
    percept.dq[:] = state[1, :JOINTS]
    percept.contact[:] = contact
    forward(nominal, percept.q, percept.tip, percept.rotation, percept.jacobian)
    forward(arm, state[0], true_tip, turn, jacobian)
    inverse(arm, state[0], state[1], np.zeros(joints), bias)
    percept.bias[:] = bias[:JOINTS]
    for i in range(3):
        percept.in_lock[i] = 0.0
        for k in range(3):
            percept.in_lock[i] += axes[k, i] * (true_tip[k] - lock[k])


@compiled
def _find_missing(c: Chain, states: Array, tau: Array, step_s: float, contact: Array) -> None:
    """Fill in the mean of the torques on the arm's joints besides those that are known.

    M (v' - v) / dt + A (w' - w) / dt + bias + d v = tau + contact, with the speeds w of the
    flywheels, which are those of the joints as far as the gears have converged. Where the key
    gives, M and bias are those of arm and key, and the rows of the hinges are left out.
    """
    steps = len(states) - 1
    needed = np.empty(states.shape[2])
    contact[:] = 0.0
    for i in range(steps):
        before, after = states[i], states[i + 1]
        inverse(c, before[0], before[1], (after[1] - before[1]) / step_s, needed)
        for j in range(JOINTS):
            needed[j] += ARMATURE * (after[2, j] - before[2, j]) / step_s + DAMPING * before[1, j]
            contact[j] += (needed[j] - tau[j]) / steps
