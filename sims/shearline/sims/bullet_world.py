"""A Bullet world with the arm and the lock in it: loading, joint states, torques, steps.

All calls of PyBullet are here. What Bullet has no word for is built from what it has: rotor
inertia from a flywheel geared to each joint, one friction coefficient for a pair of things from
the product that Bullet takes of two. Knows neither ticks nor percepts.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import os
import sys
import tempfile
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from shearline.sims import urdf
from shearline.sims.dynamics import GRAVITY
from shearline.sims.lock import PINS
from shearline.sims.panda import JOINTS, Array
from shearline.sims.scene import TICK_S, Pose, Scene, quaternion

#: Collision groups; a link meets those of its mask.
_WALLS, _BLADE, _PINS, _BITTING = 1, 2, 4, 8

#: More than any gear has to carry [N m].
_GEAR_MAX = 1e5


@dataclass(frozen=True, slots=True)
class BulletSettings:
    """How Bullet solves the scene; the defaults are the ones shown to be converged.

    Attributes:
        substeps: Steps of the engine in one tick of the controller.
        iterations: Of the solver, at most.
        residual: Sum of squared changes of impulses at which the solver stops [N^2 s^2].
        near_m: Distance at which contacts begin to be watched [m].
    """

    substeps: int = 2
    iterations: int = 200
    residual: float = 1e-14
    near_m: float = 2e-4

    @property
    def timestep_s(self) -> float:
        """Length of one step of the engine [s]."""
        return TICK_S / self.substeps


class BulletWorld:
    """One world, empty until :meth:`build`.

    Args:
        scene: What to load.
        settings: How to solve it.
    """

    def __init__(self, scene: Scene, settings: BulletSettings) -> None:
        self._bullet = bullet()
        self._settings = settings
        self._scene = scene
        self.files = {
            "arm.urdf": urdf.arm(scene),
            "lock.urdf": urdf.lock(scene),
            urdf.BITTING_MESH: urdf.bitting_mesh(scene.lock.key),
        }
        self._client = self._bullet.connect(self._bullet.DIRECT)
        weakref.finalize(self, _disconnect, self._bullet, self._client)
        self._arm = self._lock = -1
        self._joints: list[int] = []
        self._turning: list[int] = []
        self._pins: list[int] = []

    def build(self, lock: Pose, friction: float, q: Sequence[float]) -> None:
        """Throw away what there was and load everything anew, at rest.

        Nothing of the trial before survives: neither cached contacts nor the order of pairs.

        Args:
            lock: Where the lock stands.
            friction: Coulomb coefficient of every contact.
            q: Joint angles of the arm ``(7,)`` [rad].
        """
        b, client = self._bullet, self._client
        b.resetSimulation(physicsClientId=client)
        b.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        b.setPhysicsEngineParameter(
            fixedTimeStep=self._settings.timestep_s,
            numSolverIterations=self._settings.iterations,
            solverResidualThreshold=self._settings.residual,
            contactBreakingThreshold=self._settings.near_m,
            contactSlop=0.0,
            enableConeFriction=1,
            deterministicOverlappingPairs=1,
            enableFileCaching=0,
            physicsClientId=client,
        )
        w, x, y, z = quaternion(lock.rotation).tolist()
        with tempfile.TemporaryDirectory(prefix="shearline-") as folder:
            for name, text in self.files.items():
                Path(folder, name).write_text(text)
            self._arm = self._load(folder, "arm", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
            self._lock = self._load(folder, "lock", lock.position.tolist(), (x, y, z, w))
        self._name_joints()
        self._release()
        self._gear()
        self._collide(friction)
        for joint, angle in zip(self._joints, q, strict=True):
            b.resetJointState(self._arm, joint, angle, physicsClientId=client)

    def arm(self, state: Array) -> None:
        """Fill ``state (3, 7)``: angles [rad], speeds, speeds of the flywheels [rad/s]."""
        found = self._bullet.getJointStates(
            self._arm, self._turning, physicsClientId=self._client
        )
        for j in range(JOINTS):
            state[0, j], state[1, j] = found[j][:2]
            state[2, j] = found[JOINTS + j][1]

    def pins(self, travel: Array) -> None:
        """Fill ``travel (5,)`` [m]."""
        found = self._bullet.getJointStates(self._lock, self._pins, physicsClientId=self._client)
        for i in range(PINS):
            travel[i] = found[i][0]

    def step(self, tau: Sequence[float], springs: Sequence[float]) -> None:
        """Move on by one step of the engine.

        Args:
            tau: Torques on the joints ``(7,)`` [N m].
            springs: Forces on the pins ``(5,)`` [N].
        """
        b, client = self._bullet, self._client
        b.setJointMotorControlArray(
            self._arm, self._joints, b.TORQUE_CONTROL, forces=tau, physicsClientId=client
        )
        b.setJointMotorControlArray(
            self._lock, self._pins, b.TORQUE_CONTROL, forces=springs, physicsClientId=client
        )
        b.stepSimulation(physicsClientId=client)

    def _load(self, folder: str, name: str, at: Sequence[float], turn: Sequence[float]) -> int:
        b = self._bullet
        body: int = b.loadURDF(
            f"{folder}/{name}.urdf",
            at,
            turn,
            useFixedBase=True,
            flags=b.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=self._client,
        )
        return body

    def _name_joints(self) -> None:
        arm, lock = self._indices(self._arm), self._indices(self._lock)
        self._joints = [arm[f"link{j + 1}"] for j in range(JOINTS)]
        self._turning = [*self._joints, *(arm[name] for name in urdf.FLYWHEELS)]
        self._pins = [lock[pin.name] for pin in self._scene.lock.pins()]
        self._blade, self._bitting = arm[urdf.BLADE], arm[urdf.BITTING]

    def _indices(self, body: int) -> dict[str, int]:
        b, client = self._bullet, self._client
        found = (
            b.getJointInfo(body, i, physicsClientId=client)
            for i in range(b.getNumJoints(body, physicsClientId=client))
        )
        return {info[1].decode(): info[0] for info in found}

    def _release(self) -> None:
        """Switch off what Bullet switches on by itself: joint motors, and damping by the air."""
        b, client = self._bullet, self._client
        for body, joints in ((self._arm, self._turning), (self._lock, self._pins)):
            b.setJointMotorControlArray(
                body, joints, b.VELOCITY_CONTROL, forces=[0.0] * len(joints), physicsClientId=client
            )
            b.changeDynamics(body, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)

    def _gear(self) -> None:
        b, client, nowhere = self._bullet, self._client, (0.0, 0.0, 0.0)
        for joint, flywheel in zip(self._joints, self._turning[JOINTS:], strict=True):
            gear = b.createConstraint(
                self._arm, joint, self._arm, flywheel, b.JOINT_GEAR, (0.0, 0.0, 1.0), nowhere,
                nowhere, physicsClientId=client,
            )  # fmt: skip
            b.changeConstraint(gear, gearRatio=-1.0, maxForce=_GEAR_MAX, physicsClientId=client)

    def _collide(self, friction: float) -> None:
        """Let blade and walls meet, and bitting and pins; nothing else."""
        b, client = self._bullet, self._client
        for body, link, group, mask in (
            (self._lock, -1, _WALLS, _BLADE),
            (self._arm, self._blade, _BLADE, _WALLS),
            (self._arm, self._bitting, _BITTING, _PINS),
            *((self._lock, pin, _PINS, _BITTING) for pin in self._pins),
        ):
            b.setCollisionFilterGroupMask(body, link, group, mask, physicsClientId=client)
            b.changeDynamics(
                body,
                link,
                # Bullet takes the product of both sides.
                lateralFriction=friction if body == self._lock else 1.0,
                spinningFriction=0.0,
                rollingFriction=0.0,
                restitution=0.0,
                physicsClientId=client,
            )


@cache
def bullet() -> Any:
    """Return PyBullet, imported without what it prints about itself on standard output."""
    with _mute():
        return importlib.import_module("pybullet")


@contextlib.contextmanager
def _mute() -> Iterator[None]:
    """Drop what C code prints: standard output is for those who asked for data."""
    sys.stdout.flush()
    stdout, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    flush = ctypes.CDLL(None).fflush
    flush(None)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        flush(None)
        os.dup2(stdout, 1)
        os.close(stdout)
        os.close(nowhere)


def _disconnect(library: Any, client: int) -> None:
    # At the end of the process the library may have closed everything before us.
    with contextlib.suppress(library.error):
        library.disconnect(client)
