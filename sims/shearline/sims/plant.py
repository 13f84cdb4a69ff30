"""The narrow interface between a skill and whatever it acts on.

A plant is asked what it feels (:class:`Percept`), is given one torque for each joint and moves on
by one tick of 1 ms. It knows neither phases nor parameters nor cost. The arrays of a percept
belong to the plant's caller and are filled in place, so that the same percept serves compiled
loops and Python alike.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from shearline.protocol.errors import ShearlineError
from shearline.sims.lock import PINS
from shearline.sims.noise import TorqueNoise
from shearline.sims.panda import JOINTS, Array
from shearline.sims.scene import Q_START, Pose, Scene, believed_lock_pose, key_in_hand


class PlantError(ShearlineError):
    """The plant cannot go on: its state is no longer physical, or it could not be built."""


class Percept(NamedTuple):
    """What a plant feels at the beginning of a tick.

    Attributes:
        q: Joint angles ``(7,)`` [rad].
        dq: Joint speeds ``(7,)`` [rad/s].
        tip: Where joint angles and nominal grasp put the key's tip, in the base frame ``(3,)``
            [m]: a key that sits otherwise in the fingers, or gives, is not felt.
        rotation: The key's rotation in the base frame by the same reckoning ``(3, 3)``.
        jacobian: Of that tip in the base frame, translation first ``(6, 7)``.
        bias: Torque that balances gravity, centrifugal and Coriolis forces ``(7,)`` [N m].
        contact: Torque with which the surroundings act on the joints, mean over the last tick
            ``(7,)`` [N m].
        in_lock: Position of the true tip in the frame of the lock itself ``(3,)`` [m]; z is the
            depth. It decides the verdict and steers nothing.
        pins: How far the pins are pushed in ``(5,)`` [m]; 0 where a plant cannot know.
    """

    q: Array
    dq: Array
    tip: Array
    rotation: Array
    jacobian: Array
    bias: Array
    contact: Array
    in_lock: Array
    pins: Array


def empty_percept() -> Percept:
    """Return a percept of zeros, to be filled."""
    return Percept(
        q=np.zeros(JOINTS),
        dq=np.zeros(JOINTS),
        tip=np.zeros(3),
        rotation=np.zeros((3, 3)),
        jacobian=np.zeros((6, JOINTS)),
        bias=np.zeros(JOINTS),
        contact=np.zeros(JOINTS),
        in_lock=np.zeros(3),
        pins=np.zeros(PINS),
    )


@dataclass(frozen=True, slots=True)
class Setup:
    """What differs from trial to trial.

    A plant honours all of it but the noise, which whoever runs the trial adds to what the plant
    says of contacts: it is the same on every engine.

    Attributes:
        lock: Where the lock truly is.
        friction: Coulomb coefficient of every contact, or ``None`` for the scene's own.
        pin_scale: Factor on stiffness and preload of each pin ``(5,)``.
        q: Joint angles at the start ``(7,)`` [rad].
        grip: How the key sits in the fingers off the nominal grasp ``(6,)``: shift [m], then turn
            [rad], in its own frame about the middle of the grip
            (:data:`~shearline.sims.grasp.GRIP_M` behind the tip).
        pad_scale: Factor on the stiffness of the scene's grasp, if that gives at all.
        noise: What the torque sensors add, or ``None``.
    """

    lock: Pose = field(default_factory=believed_lock_pose)
    friction: float | None = None
    pin_scale: tuple[float, ...] = (1.0,) * PINS
    q: tuple[float, ...] = tuple(Q_START.tolist())
    grip: tuple[float, ...] = (0.0,) * 6
    pad_scale: float = 1.0
    noise: TorqueNoise | None = None

    def key_in_hand(self, scene: Scene) -> Pose:
        """Return the frame of the key in that of the last link, nothing loaded.

        Raises:
            PlantError: If the key is to sit off in a scene in which it is one with the hand.
        """
        if scene.grasp is None and any(self.grip):
            raise PlantError("the key sits off in the fingers, expected a scene with a grasp")
        return key_in_hand(self.grip)


class Plant(Protocol):
    """One arm with a key in front of one lock."""

    @property
    def engine(self) -> str:
        """Fingerprint of what computes or moves: engine, version, model."""
        ...

    def reset(self, setup: Setup) -> None:
        """Go to the start of a trial, at rest."""
        ...

    def sense(self, percept: Percept) -> None:
        """Fill ``percept`` with the present; to be called once before each :meth:`step`."""
        ...

    def step(self, tau: Array) -> None:
        """Apply the torques ``tau (7,)`` [N m] for one tick.

        Raises:
            PlantError: If the state is no longer physical.
        """
        ...
