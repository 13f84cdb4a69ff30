"""The key-in-lock scene in PyBullet, tick by tick.

Bullet collides, solves contacts and moves. What a percept needs beyond joint states comes from
:mod:`shearline.sims.dynamics`: the same arm, quicker to ask. Contact torques on the joints are what
is missing in the equations of motion between two steps; since Bullet moves by semi-implicit Euler,
that is exact. Knows no skill.
"""

from __future__ import annotations

import hashlib
import importlib.metadata

import numpy as np

from shearline.protocol.errors import ConfigError
from shearline.sims.bullet_world import BulletSettings, BulletWorld
from shearline.sims.compiled import compiled
from shearline.sims.dynamics import Chain, chain, forward, inverse
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
        settings: How Bullet is to solve it.

    Raises:
        ConfigError: If the key is to sit off in the fingers, or to give.
    """

    def __init__(self, scene: Scene | None = None, settings: BulletSettings | None = None) -> None:
        self.scene = scene or Scene()
        if self.scene.grasp is not None:
            raise ConfigError(
                "in PyBullet key and hand are one piece: leave the switches grasp and pads out,"
                " or run the task on MuJoCo"
            )
        self.settings = settings or BulletSettings()
        self.world = BulletWorld(self.scene, self.settings)
        described = repr((self.world.files, self.settings)).encode()
        self.model_hash = hashlib.sha256(described).hexdigest()[:12]
        self._chain = chain(self.scene)
        self._setup = Setup()
        self._before, self._now = np.zeros((3, JOINTS)), np.zeros((3, JOINTS))
        self._pins, self._springs = np.zeros(PINS), np.zeros(PINS)
        self._contact = np.zeros(JOINTS)
        self._ticks = 0

    @property
    def engine(self) -> str:
        """Engine, version and the hash of the model and of how it is solved."""
        return f"pybullet {importlib.metadata.version('pybullet')} model {self.model_hash}"

    def reset(self, setup: Setup) -> None:
        """Go to the start of a trial, at rest."""
        lock = self.scene.lock
        friction = lock.friction if setup.friction is None else setup.friction
        self.world.build(setup.lock, friction, setup.q)
        self._setup, self._ticks = setup, 0
        self._stiffness = lock.pin_stiffness * np.array(setup.pin_scale)
        self._contact[:] = 0.0
        self._read()

    def sense(self, percept: Percept) -> None:
        """Fill ``percept`` with the present."""
        lock = self._setup.lock
        _perceive(self._chain, self._now, self._contact, lock.position, lock.rotation, percept)
        percept.pins[:] = self._pins

    def step(self, tau: Array) -> None:
        """Apply ``tau (7,)`` [N m] for one tick."""
        torques = tau.tolist()
        self._contact[:] = 0.0
        lock = self.scene.lock
        for _ in range(self.settings.substeps):
            springs = -self._stiffness * (self._pins + lock.pin_preload_n / lock.pin_stiffness)
            self._before, self._now = self._now, self._before
            self.world.step(torques, springs.tolist())
            self._read()
            _add_missing(
                self._chain, self._before, self._now, tau, self.settings.timestep_s, self._contact
            )
        self._contact /= self.settings.substeps
        self._ticks += 1
        if not np.abs(self._now[1]).max() < SPEED_MAX:
            raise PlantError(
                f"a joint turned faster than {SPEED_MAX:g} rad/s in tick {self._ticks}:"
                " the simulation is no longer physical, the trial has no verdict"
            )

    def _read(self) -> None:
        self.world.arm(self._now)
        self.world.pins(self._pins)


@compiled
def _perceive(
    c: Chain, state: Array, contact: Array, lock: Array, axes: Array, percept: Percept
) -> None:
    """Fill all of a percept but the pins."""
    percept.q[:] = state[0]
    percept.dq[:] = state[1]
    percept.contact[:] = contact
    forward(c, percept.q, percept.tip, percept.rotation, percept.jacobian)
    inverse(c, percept.q, percept.dq, np.zeros(JOINTS), percept.bias)
    for i in range(3):
        percept.in_lock[i] = 0.0
        for k in range(3):
            percept.in_lock[i] += axes[k, i] * (percept.tip[k] - lock[k])


@compiled
def _add_missing(
    c: Chain, before: Array, after: Array, tau: Array, step_s: float, contact: Array
) -> None:
    """Add the torques that acted in one step besides those that are known.

    M (v' - v) / dt + A (w' - w) / dt + bias + d v = tau + contact, with the speeds w of the
    flywheels, which are those of the joints as far as the gears have converged.
    """
    needed = np.empty(JOINTS)
    inverse(c, before[0], before[1], (after[1] - before[1]) / step_s, needed)
    for j in range(JOINTS):
        needed[j] += ARMATURE * (after[2, j] - before[2, j]) / step_s + DAMPING * before[1, j]
        contact[j] += needed[j] - tau[j]
