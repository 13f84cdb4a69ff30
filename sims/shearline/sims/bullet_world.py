"""A Bullet world with the arm and the lock in it: loading, joint states, torques, steps.

All calls of PyBullet are here. What Bullet has no word for is built from what it has: rotor
inertia from a flywheel geared to each joint, one friction coefficient for a pair of things from
the product that Bullet takes of two. Knows neither ticks nor percepts.
"""

from __future__ import annotations

import contextlib
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

from shearline.sims import urdf
from shearline.sims.dynamics import GRAVITY
from shearline.sims.hold import Hold, hold
from shearline.sims.lock import PINS
from shearline.sims.panda import JOINTS, Array
from shearline.sims.plant import Setup
from shearline.sims.scene import TICK_S, Scene, quaternion

#: Bullet numbers joints, and the links behind them, in the order of the file.
_JOINTS, _PINS = tuple(range(JOINTS)), tuple(range(PINS))

#: More than any gear has to carry [N m].
_GEAR_MAX = 1e5

#: Bullet cuts off what moves faster. A key let go of between its pads does so above Bullet's own
#: 100 [rad/s].
_SPEED_MAX = 1e4


@dataclass(frozen=True, slots=True)
class BulletSettings:
    """How Bullet solves the scene; the defaults are the ones shown to be converged.

    Contacts are springs and dampers between steel and brass, not rigid: what a rigid one sinks in
    by has to be pushed out again within a few steps, and a micrometre in a wedge then takes a
    thousand newtons.

    Attributes:
        substeps: Steps of the engine in one tick of the controller.
        iterations: Of the solver, at most.
        residual: Sum of squared changes of impulses at which the solver stops [N^2 s^2].
        stiffness: Of contacts [N/m].
        damping: Of contacts [N s/m].
        near: Contacts are watched from this share of the smaller body's reach on: 36 um before the
            walls, 100 um before the pins.
    """

    substeps: int = 1
    iterations: int = 50
    residual: float = 1e-8
    stiffness: float = 3e7
    damping: float = 3e4
    near: float = 1e-3

    @property
    def timestep_s(self) -> float:
        """Length of one step of the engine [s]."""
        return TICK_S / self.substeps


def converged(scene: Scene) -> BulletSettings:
    """Return settings that were shown to be converged for a scene.

    A key that is let go of between its pads goes a millimetre in a millisecond: at whole
    milliseconds it is found deep in the wall, and thrown out with a thousand newtons.
    """
    return BulletSettings(substeps=2 if scene.grip_joints else 1)


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
        self._moving = tuple(range(JOINTS + scene.grip_joints))
        self.files = {
            "arm.urdf": urdf.arm(scene, hold(scene, Setup(), settings.timestep_s)),
            "rotors.urdf": urdf.rotors(),
            "walls.urdf": urdf.lock_walls(scene),
            "pins.urdf": urdf.lock_pins(scene),
            urdf.BITTING_MESH: urdf.bitting_mesh(scene.lock.key),
        }
        self._client = self._bullet.connect(self._bullet.DIRECT)
        weakref.finalize(self, _disconnect, self._bullet, self._client)
        self._arm = self._rotors = self._walls = self._pins = -1

    def build(self, setup: Setup, held: Hold | None) -> None:
        """Throw away what there was and load everything anew, at rest.

        Nothing of the trial before survives: neither cached contacts nor the order of pairs.

        Args:
            setup: Of the trial.
            held: How the fingers hold the key; ``None``: hand and key are one piece.
        """
        b, client = self._bullet, self._client
        lock, own = setup.lock, self._scene.lock.friction
        files = self.files | {"arm.urdf": urdf.arm(self._scene, held)}
        empty(b, client, self._settings)
        w, x, y, z = quaternion(lock.rotation).tolist()
        with tempfile.TemporaryDirectory(prefix="shearline-") as folder:
            for name, text in files.items():
                Path(folder, name).write_text(text)
            self._arm = self._load(folder, "arm")
            self._rotors = self._load(folder, "rotors")
            place = (lock.position.tolist(), (x, y, z, w))
            self._walls = self._load(folder, "walls", *place, useMaximalCoordinates=True)
            self._pins = self._load(folder, "pins", *place)
        self._release()
        self._gear()
        self._collide(own if setup.friction is None else setup.friction)
        for joint, angle in enumerate(setup.q):
            b.resetJointState(self._arm, joint, angle, physicsClientId=client)

    def arm(self, state: Array) -> None:
        """Fill ``state (3, n)``: angles [rad], speeds, speeds of the flywheels [rad/s].

        The hinges of the grasp come behind the arm's joints and have no flywheels.
        """
        b, client = self._bullet, self._client
        moving = b.getJointStates(self._arm, self._moving, physicsClientId=client)
        turning = b.getJointStates(self._rotors, _JOINTS, physicsClientId=client)
        state[0] = [joint[0] for joint in moving]
        state[1] = [joint[1] for joint in moving]
        state[2, :JOINTS] = [joint[1] for joint in turning]

    def pins(self) -> list[float]:
        """Return how far the pins are pushed in ``(5,)`` [m]."""
        found = self._bullet.getJointStates(self._pins, _PINS, physicsClientId=self._client)
        return [pin[0] for pin in found]

    def step(self, tau: Sequence[float], springs: Sequence[float]) -> None:
        """Move on by one step of the engine.

        Args:
            tau: Torques on the joints, then on the hinges of the grasp ``(n,)`` [N m].
            springs: Forces on the pins ``(5,)`` [N].
        """
        b, client = self._bullet, self._client
        b.setJointMotorControlArray(
            self._arm, self._moving, b.TORQUE_CONTROL, forces=tau, physicsClientId=client
        )
        b.setJointMotorControlArray(
            self._pins, _PINS, b.TORQUE_CONTROL, forces=springs, physicsClientId=client
        )
        b.stepSimulation(physicsClientId=client)

    def _load(self, folder: str, name: str, *place: Sequence[float], **how: bool) -> int:
        b = self._bullet
        body: int = b.loadURDF(
            f"{folder}/{name}.urdf",
            *place,
            useFixedBase=True,
            flags=b.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=self._client,
            **how,
        )
        return body

    def _release(self) -> None:
        """Switch off what Bullet switches on: motors, damping by the air, a speed limit."""
        b, client = self._bullet, self._client
        moving = ((self._arm, self._moving), (self._rotors, _JOINTS), (self._pins, _PINS))
        for body, joints in moving:
            b.setJointMotorControlArray(
                body, joints, b.VELOCITY_CONTROL, forces=[0.0] * len(joints), physicsClientId=client
            )
            b.changeDynamics(
                body,
                -1,
                linearDamping=0.0,
                angularDamping=0.0,
                maxJointVelocity=_SPEED_MAX,
                physicsClientId=client,
            )

    def _gear(self) -> None:
        b, client, nowhere = self._bullet, self._client, (0.0, 0.0, 0.0)
        for joint in _JOINTS:
            gear = b.createConstraint(
                self._arm, joint, self._rotors, joint, b.JOINT_GEAR, (0.0, 0.0, 1.0), nowhere,
                nowhere, physicsClientId=client,
            )  # fmt: skip
            b.changeConstraint(gear, gearRatio=-1.0, maxForce=_GEAR_MAX, physicsClientId=client)

    def _collide(self, friction: float) -> None:
        """Let blade and walls meet, and bitting and pins; nothing else.

        Bullet multiplies the friction of both sides and puts their stiffnesses in series, so one
        side has the numbers and the other is perfect.
        """
        b, client = self._bullet, self._client
        lock = {
            "lateralFriction": friction,
            "contactStiffness": self._settings.stiffness,
            "contactDamping": self._settings.damping,
        }
        key, links = {"lateralFriction": 1.0}, self._links()
        blade = links["hand" if self._scene.grasp is None else "blade"]
        for body, link, surface, group, mask in (
            (self._walls, -1, lock, 1, 2),
            (self._arm, blade, key, 2, 1),
            *((self._pins, pin, lock, 4, 8) for pin in _PINS),
            (self._arm, links["key"], key, 8, 4),
        ):
            b.setCollisionFilterGroupMask(body, link, group, mask, physicsClientId=client)
            b.changeDynamics(
                body,
                link,
                spinningFriction=0.0,
                rollingFriction=0.0,
                restitution=0.0,
                physicsClientId=client,
                **surface,
            )

    def _links(self) -> dict[str, int]:
        """Return what Bullet numbers the arm's links by."""
        b, client = self._bullet, self._client
        count = b.getNumJoints(self._arm, physicsClientId=client)
        infos = (b.getJointInfo(self._arm, i, physicsClientId=client) for i in range(count))
        return {info[12].decode(): info[0] for info in infos}


def empty(library: Any, client: int, settings: BulletSettings) -> None:
    """Throw away what is in a world, and say how it is to be solved."""
    library.resetSimulation(physicsClientId=client)
    library.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
    library.setPhysicsEngineParameter(
        fixedTimeStep=settings.timestep_s,
        numSolverIterations=settings.iterations,
        solverResidualThreshold=settings.residual,
        contactBreakingThreshold=settings.near,
        contactSlop=0.0,
        enableConeFriction=1,
        deterministicOverlappingPairs=1,
        enableFileCaching=0,
        physicsClientId=client,
    )


@cache
def bullet() -> Any:
    """Return PyBullet, imported without the line that it writes about itself."""
    with _mute():
        return importlib.import_module("pybullet")


@contextlib.contextmanager
def _mute() -> Iterator[None]:
    """Drop what C code writes on standard error."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def _disconnect(library: Any, client: int) -> None:
    # At the end of the process the library may have closed everything before us.
    with contextlib.suppress(library.error):
        library.disconnect(client)
