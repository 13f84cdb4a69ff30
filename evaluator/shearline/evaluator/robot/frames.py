"""Poses as 4x4 matrices: made, taken apart, compared. Lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from shearline.evaluator.robot.port import Array
from shearline.sims.panda import rotation_x, rotation_y, rotation_z


def rpy(angles: Sequence[float]) -> Array:
    """Return Rz(yaw) Ry(pitch) Rx(roll) for ``(roll, pitch, yaw)``."""
    roll, pitch, yaw = angles
    turned: Array = rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)
    return turned


def pose(position: Sequence[float] | Array, rotation: Array) -> Array:
    """Return a pose ``(4, 4)`` from a position ``(3,)`` and a rotation ``(3, 3)``."""
    made = np.eye(4)
    made[:3, :3] = rotation
    made[:3, 3] = position
    return made


def inverse(of: Array) -> Array:
    """Return the inverse of a pose."""
    back = of[:3, :3].T
    return pose(-back @ of[:3, 3], back)


def in_lock(o_t_lock: Array, position: Sequence[float] | Array, turn: Sequence[float]) -> Array:
    """Return the base-frame pose of a tip at ``position (3,)`` in the frame of the lock.

    ``turn`` is that of the manipulation layer: R = Rx(turn_x) Ry(turn_y) Rz(turn_z).
    """
    rotation = rotation_x(turn[0]) @ rotation_y(turn[1]) @ rotation_z(turn[2])
    placed: Array = o_t_lock @ pose(position, rotation)
    return placed


def angle(rotation: Array) -> float:
    """Return the angle of a rotation ``(3, 3)``, 0 to pi."""
    sine = math.hypot(
        rotation[2, 1] - rotation[1, 2],
        rotation[0, 2] - rotation[2, 0],
        rotation[1, 0] - rotation[0, 1],
    )
    return math.atan2(sine, float(np.trace(rotation)) - 1.0)


def apart(one: Array, other: Array) -> tuple[float, float]:
    """Return how far two poses are apart [m] and by what angle [rad]."""
    off = inverse(one) @ other
    return float(np.linalg.norm(off[:3, 3])), angle(off[:3, :3])


def is_pose(of: Array) -> bool:
    """Tell whether a matrix ``(4, 4)`` is a pose, to what float32 can carry."""
    turn = of[:3, :3]
    return (
        of.shape == (4, 4)
        and bool(np.isfinite(of).all())
        and bool(np.abs(turn @ turn.T - np.eye(3)).max() < 1e-3)
        and bool(np.abs(of[3] - (0.0, 0.0, 0.0, 1.0)).max() < 1e-6)
    )
