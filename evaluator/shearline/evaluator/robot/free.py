"""A Franka's motion in free space: its line, and how hard it may push on the way."""

from __future__ import annotations

import math

import numpy as np

from shearline.evaluator.robot.frames import apart
from shearline.evaluator.robot.path import Line
from shearline.evaluator.robot.port import Array, Contact, Guard, Sample

#: Stiffness of free motions [N/m, N m/rad] and the error that pulls at most [m, rad].
STIFFNESS = np.array([2000.0] * 3 + [100.0] * 3)
CLIP_M, CLIP_RAD = 0.02, 0.2

#: What an arm weighs at the tip, about [kg, kg m^2].
MASS = np.array([6.0] * 3 + [0.3] * 3)

#: The damping ratio that a unit mass would have; the arm's own is smaller.
RATIO = 1.4
DAMPING = 2.0 * RATIO * np.sqrt(STIFFNESS)

#: So little acceleration does not make the arm swing on the controller's spring [m/s^2, rad/s^2].
GAIN_MPS2, GAIN_RADPS2 = 0.3, 2.0

#: A free motion has arrived within these [m, rad], at this speed of the joints [rad/s].
ARRIVED_M, ARRIVED_RAD, ARRIVED_RADPS = 2e-4, 1e-3, 5e-3


def free_motion(start: Array, goal: Array, speed_mps: float, guard: Guard) -> tuple[Line, Contact]:
    """Return a line from pose to pose, and the impedance under which an arm follows it.

    It goes no faster than the clip pulls: there damping takes the whole of K clip. Turning is
    slower by a half, for a Panda's damping of it is 1.4 times as large.
    """
    clip_m, clip_rad = free_clips(guard)
    most_mps = clip_m * STIFFNESS[0] / DAMPING[0]
    most_radps = clip_rad * STIFFNESS[3] / DAMPING[3] / 1.5
    speed_mps = min(speed_mps, most_mps)
    line = Line(start, goal, speed_mps, most_radps, GAIN_MPS2, GAIN_RADPS2)
    t_max_s = 2.0 * line.length_s + 5.0
    return line, Contact(np.eye(3), STIFFNESS, DAMPING, clip_m, clip_rad, t_max_s)


def free_clips(guard: Guard) -> tuple[float, float]:
    """Return the errors that pull at most in a free motion, along each axis [m, rad].

    All three axes together then push no more than the guard allows.
    """
    push_n = min(guard.push_max_n, guard.force_max_n)
    twist_nm = min(guard.twist_max_nm, guard.torque_max_nm)
    clip_m = push_n / (math.sqrt(3.0) * STIFFNESS[0])
    return min(CLIP_M, clip_m), min(CLIP_RAD, twist_nm / STIFFNESS[3])


def lead(line: Line, t_s: float, turning: float) -> Array:
    """Return how far the reference leads, for the arm to be on its line ``(6,)`` [m, rad].

    The controller takes no feed-forward force: what brakes and gains speed is (D v + M a) / K.

    Args:
        line: What the arm is to follow.
        t_s: Since it began [s].
        turning: How much more than it was told to the controller brakes turning.
    """
    speed, gain = line.rates(t_s)
    damping = DAMPING * np.array([1.0] * 3 + [turning] * 3)
    ahead: Array = (damping * speed + MASS * gain) / STIFFNESS
    return ahead


def arrived(sample: Sample, goal: Array) -> bool:
    """Tell whether a free motion to ``goal`` is over."""
    off_m, off_rad = apart(goal, sample.o_t_ee)
    speed = float(np.abs(sample.dq).max())
    return off_m < ARRIVED_M and off_rad < ARRIVED_RAD and speed < ARRIVED_RADPS
