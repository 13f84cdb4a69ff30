"""From pose to pose: a straight line that is smooth at both ends, and what is between two poses."""

from __future__ import annotations

import math

import numpy as np

from shearline.evaluator.robot.frames import angle, apart
from shearline.evaluator.robot.port import Array, Contact
from shearline.sims.scene import quaternion as w_first

#: Peak of the rate of s(u) = 10 u^3 - 15 u^4 + 6 u^5, the polynomial of least jerk.
PEAK_RATE = 1.875

#: Peak of its second derivative.
PEAK_GAIN = 10.0 / math.sqrt(3.0)

#: The arm follows its reference with some overshoot; it must not exceed the speed asked for.
SPEED_SHARE = 0.85

#: Turning is limited to as much as the tip's speed on an arm of this length [m].
LEVER_M = 0.2


class Line:
    """Position along a straight line, orientation about one axis, by minimum jerk.

    Args:
        begin: Pose ``(4, 4)``.
        end: Pose ``(4, 4)``.
        speed_mps: Largest speed of the tip.
        speed_radps: Largest speed of turning.
        gain_mps2: Largest acceleration of the tip.
        gain_radps2: Largest acceleration of turning.

    Attributes:
        length_s: How long it takes [s].
    """

    def __init__(
        self,
        begin: Array,
        end: Array,
        speed_mps: float,
        speed_radps: float = math.inf,
        gain_mps2: float = math.inf,
        gain_radps2: float = math.inf,
    ) -> None:
        self._begin, self._end = begin, end
        off_m, off_rad = apart(begin, end)
        self._turn = off_rad
        self._axis = axis(begin[:3, :3].T @ end[:3, :3])
        turning_s = off_rad / min(speed_mps / LEVER_M, speed_radps)
        gaining_s = math.sqrt(PEAK_GAIN * max(off_m / gain_mps2, off_rad / gain_radps2))
        self.length_s = max(PEAK_RATE * max(off_m / speed_mps, turning_s) / SPEED_SHARE, gaining_s)

    def at(self, t_s: float) -> Array:
        """Return the pose at a time from the beginning [s]."""
        if t_s >= self.length_s:
            return self._end.copy()
        u = t_s / self.length_s
        share = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        pose = np.eye(4)
        pose[:3, :3] = self._begin[:3, :3] @ turned(self._axis, share * self._turn)
        pose[:3, 3] = self._begin[:3, 3] + share * (self._end[:3, 3] - self._begin[:3, 3])
        return pose

    def rates(self, t_s: float) -> tuple[Array, Array]:
        """Return speeds and accelerations at that time ``(6,)``, base frame [m/s, m/s^2, rad..]."""
        if t_s >= self.length_s:
            return np.zeros(6), np.zeros(6)
        u = t_s / self.length_s
        turn = self._turn * (self._begin[:3, :3] @ self._axis)
        way = np.concatenate([self._end[:3, 3] - self._begin[:3, 3], turn])
        speed = 30.0 * u**2 * (1.0 - u) ** 2 / self.length_s
        gain = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / self.length_s**2
        return speed * way, gain * way


def axis(rotation: Array) -> Array:
    """Return the unit axis ``(3,)`` of a rotation by less than half a turn."""
    r = rotation
    twice = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    length = float(np.linalg.norm(twice))
    return twice / length if length > 0.0 else np.array([0.0, 0.0, 1.0])


def turned(about: Array, by_rad: float) -> Array:
    """Return the rotation ``(3, 3)`` about a unit axis (Rodrigues)."""
    x, y, z = about
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = (
        np.eye(3) + math.sin(by_rad) * cross + (1.0 - math.cos(by_rad)) * cross @ cross
    )
    return rotation


def vector(rotation: Array) -> Array:
    """Return a rotation as axis times angle ``(3,)`` [rad]."""
    along: Array = axis(rotation) * angle(rotation)
    return along


def off(pose: Array, goal: Array) -> Array:
    """Return what is missing from a pose to a goal ``(6,)``, in the base frame [m, rad]."""
    turn = vector(goal[:3, :3] @ pose[:3, :3].T)
    return np.concatenate([goal[:3, 3] - pose[:3, 3], turn])


def shifted(pose: Array, by: Array) -> Array:
    """Return a pose moved and turned by ``(6,)`` in the base frame [m, rad]."""
    angle_rad = float(np.linalg.norm(by[3:]))
    moved = pose.copy()
    moved[:3, 3] += by[:3]
    if angle_rad > 0.0:
        moved[:3, :3] = turned(by[3:] / angle_rad, angle_rad) @ pose[:3, :3]
    return moved


def clipped(target: Array, tip: Array, contact: Contact) -> Array:
    """Return the pose nearest to ``target`` that is within the clip of the tip's pose."""
    back = np.kron(np.eye(2), contact.o_r_c.T)
    clip = np.array([contact.clip_m] * 3 + [contact.clip_rad] * 3)
    near: Array = np.clip(back @ off(tip, target), -clip, clip)
    return shifted(tip, back.T @ near)


def quaternion(rotation: Array) -> Array:
    """Return a rotation ``(3, 3)`` as a quaternion with w last."""
    w, x, y, z = w_first(rotation)
    return np.array([x, y, z, w])
