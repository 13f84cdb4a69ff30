"""What the skill sees of a robot's sample: tip, turn, speed and wrench in the frame of the lock."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from shearline.evaluator.robot.frames import inverse
from shearline.evaluator.robot.port import Array, Sample

#: The speed is a difference of poses through a first-order low-pass of this corner [Hz].
SPEED_HZ = 30.0


class View(NamedTuple):
    """A sample as the layers want it; all in the frame of the believed lock.

    Attributes:
        t_s: The robot's clock [s].
        tip: ``(3,)`` [m]; z is the depth.
        turn: ``(3,)`` [rad], R = Rx Ry Rz.
        speed_z: Along the axis, low-passed [m/s].
        wrench: Of the surroundings on the tip ``(6,)`` [N, N m].
        tau_ext: ``(n,)``.
    """

    t_s: float
    tip: Array
    turn: Array
    speed_z: float
    wrench: Array
    tau_ext: Array


class Sight:
    """Turns samples into views, one after the other.

    Args:
        o_t_lock: Believed pose of the lock in the base frame ``(4, 4)``.
    """

    def __init__(self, o_t_lock: Array) -> None:
        self._lock_t_o = inverse(o_t_lock)
        self._last: tuple[float, float] | None = None
        self._speed_z = 0.0

    def view(self, sample: Sample) -> View:
        """Return a sample as a view; samples must come in order."""
        at = self._lock_t_o @ sample.o_t_ee
        back = self._lock_t_o[:3, :3]
        tip = np.ascontiguousarray(at[:3, 3])
        self._differ(sample.t_s, float(tip[2]))
        wrench = np.concatenate([back @ sample.o_f_ext[:3], back @ sample.o_f_ext[3:]])
        tau_ext = np.ascontiguousarray(sample.tau_ext)
        return View(sample.t_s, tip, turn_of(at[:3, :3]), self._speed_z, wrench, tau_ext)

    def _differ(self, t_s: float, z_m: float) -> None:
        if self._last is not None and t_s > self._last[0]:
            dt_s = t_s - self._last[0]
            weight = 1.0 - math.exp(-2.0 * math.pi * SPEED_HZ * dt_s)
            self._speed_z += weight * ((z_m - self._last[1]) / dt_s - self._speed_z)
        self._last = (t_s, z_m)


def turn_of(rotation: Array) -> Array:
    """Return ``(3,)`` angles with R = Rx(a) Ry(b) Rz(c), for tilts far from a quarter turn."""
    b = math.asin(min(max(float(rotation[0, 2]), -1.0), 1.0))
    a = math.atan2(-rotation[1, 2], rotation[2, 2])
    c = math.atan2(-rotation[0, 1], rotation[0, 0])
    return np.array([a, b, c])
