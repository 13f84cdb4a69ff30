"""How the fingers hold the key in one trial: where it sits, and the hinges about which it gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shearline.sims.grasp import GRIP_M
from shearline.sims.hinge import Hinge, stepped
from shearline.sims.lock import Key, Triple
from shearline.sims.panda import Array
from shearline.sims.plant import Setup
from shearline.sims.scene import KEY_INERTIA, KEY_MASS, KEY_TURN, Pose, Scene

#: From the middle of the grip to the tip, in the key's frame [m].
TO_TIP: Array = np.array([0.0, 0.0, GRIP_M])


@dataclass(frozen=True, slots=True)
class Hold:
    """A key between fingers.

    Attributes:
        middle: Of the grip, with the axes of the key, in the frame of the last link.
        turn: The same axes as angles about x, then y, then z [rad].
        hinges: About x and, turned with the former, y of the key through that point; none if
            nothing gives.
    """

    middle: Pose
    turn: Triple
    hinges: tuple[Hinge, ...] = ()


def hold(scene: Scene, setup: Setup, step_s: float) -> Hold | None:
    """Return how the key is held, or ``None`` where hand and key are one piece.

    Args:
        scene: With its grasp.
        setup: Of the trial.
        step_s: Length of the engine's steps [s].

    Raises:
        PlantError: If the key is to sit off in a scene in which it is one with the hand.
    """
    middle = setup.key_in_hand(scene).moved(-TO_TIP, np.zeros(3))
    if scene.grasp is None:
        return None
    x, y, z = setup.grip[3:]
    turning = _inertia(scene.lock.key)
    springs = zip(scene.grasp.stiffness, scene.grasp.damping, turning, strict=False)
    hinges = (
        stepped(setup.pad_scale * stiffness, damping, inertia, step_s)
        for stiffness, damping, inertia in springs
    )
    return Hold(middle, (x, y, KEY_TURN + z), tuple(hinges))


def _inertia(key: Key) -> tuple[float, float]:
    """Return the key's inertia about x and y through the middle of the grip [kg m^2]."""
    steiner = KEY_MASS * (GRIP_M - key.length_m) ** 2
    return KEY_INERTIA[0] + steiner, KEY_INERTIA[1] + steiner
