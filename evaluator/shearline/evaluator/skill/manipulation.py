"""The manipulation layer: what is commanded in each phase.

Approach: along a minimum-jerk line to a pose in front of the believed mouth, offset and tilted as
the tuple says. Contact: along the believed axis at ``con_speed`` until the semantic layer says
contact. Insertion: push along the axis with a feed-forward force and no stiffness, lead offset and
tilt back to the axis, wiggle with forces and torques on Lissajous figures. Extraction: straight
back along the axis.

Everything is in the frame of the *believed* lock (origin in the mouth, z into it). It decides
nothing and computes no torque.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from shearline.evaluator.skill.parameters import Parameters
from shearline.evaluator.skill.semantic import APPROACH, CONTACT, EXTRACTION, INSERTION
from shearline.sims.compiled import compiled
from shearline.sims.panda import Array

#: The approach ends with the tip this far in front of the believed mouth [m].
HOVER_M = 3e-3

#: Duration of the approach [s].
APPROACH_S = 0.8

#: Stiffness of approach and extraction: translation [N/m], rotation [N m/rad].
APPROACH_K = 3000.0
APPROACH_K_ROT = 300.0

#: Damping ratio of approach and extraction; ``xi`` is for the phases in contact.
APPROACH_XI = 1.0

#: Stiffness along the axis while seeking contact and pulling out [N/m].
AXIAL_K = 1500.0

#: The axial reference leads the tip by at most this much [m]: bounds the static force.
LEAD_M = 15e-3

#: Drag along the axis on what the key moves faster than ``ins_speed`` [N s/m].
BRAKE = 300.0

#: Speed of the extraction [m/s].
EXTRACTION_SPEED = 0.05


class Command(NamedTuple):
    """What the control layer is to do, in the frame of the believed lock; filled in place.

    Attributes:
        x: Where the tip is to be ``(3,)`` [m].
        turn: Rotation vector of the key ``(3,)`` [rad]; small.
        v: Speed of ``x`` ``(3,)`` [m/s].
        w: Speed of ``turn`` ``(3,)`` [rad/s].
        stiffness: Translation ``[:3]`` [N/m], rotation ``[3:]`` [N m/rad].
        ratio: Damping ratio of all axes that are held ``(1,)``.
        drag: Damping of translations on top of that ``(3,)`` [N s/m].
        wrench: Feed-forward force ``[:3]`` [N] and torque ``[3:]`` [N m]: push and wiggle.
    """

    x: Array
    turn: Array
    v: Array
    w: Array
    stiffness: Array
    ratio: Array
    drag: Array
    wrench: Array


def empty_command() -> Command:
    """Return a command of zeros, to be filled."""
    return Command(
        x=np.zeros(3),
        turn=np.zeros(3),
        v=np.zeros(3),
        w=np.zeros(3),
        stiffness=np.zeros(6),
        ratio=np.zeros(1),
        drag=np.zeros(3),
        wrench=np.zeros(6),
    )


@compiled
def command(
    c: Command,
    phase: int,
    phase_ticks: int,
    tip: Array,
    speed_z: float,
    p: Parameters,
    tick_s: float,
) -> None:
    """Move the command on by one tick.

    Args:
        c: The command of the tick before; changed in place.
        phase: Phase the semantic layer has decided on.
        phase_ticks: Ticks spent in it; 0 on entry.
        tip: Tip in the frame of the believed lock ``(3,)`` [m].
        speed_z: Its speed along the axis [m/s].
        p: The tuple being tried.
        tick_s: Length of a tick [s].
    """
    c.v[:] = 0.0
    c.w[:] = 0.0
    c.drag[:] = 0.0
    c.wrench[:] = 0.0
    if phase == APPROACH:
        _approach(c, phase_ticks * tick_s, tip, p, tick_s)
    elif phase == CONTACT:
        _contact(c, tip, p, tick_s)
    elif phase == INSERTION:
        _insertion(c, phase_ticks * tick_s, tip, speed_z, p, tick_s)
    elif phase == EXTRACTION:
        _extraction(c, phase_ticks, tip, tick_s)


@compiled
def _approach(c: Command, t_s: float, tip: Array, p: Parameters, tick_s: float) -> None:
    """Minimum jerk: s(u) = 10 u^3 - 15 u^4 + 6 u^5 (Flash and Hogan 1985)."""
    if t_s == 0.0:
        c.x[:] = tip
        c.turn[:] = 0.0
    left = _left_to_go(t_s)
    step = 0.0 if left <= 0.0 else 1.0 - _left_to_go(t_s + tick_s) / left
    goal = (p.app_off_x, p.app_off_y, -HOVER_M)
    tilt = (p.app_tilt_x, p.app_tilt_y, 0.0)
    for i in range(3):
        c.v[i] = (goal[i] - c.x[i]) * step / tick_s
        c.w[i] = (tilt[i] - c.turn[i]) * step / tick_s
        c.x[i] += c.v[i] * tick_s
        c.turn[i] += c.w[i] * tick_s
    _hold(c, APPROACH_K, APPROACH_K, APPROACH_K_ROT, APPROACH_XI)


@compiled
def _left_to_go(t_s: float) -> float:
    u = min(t_s / APPROACH_S, 1.0)
    return 1.0 - u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)


@compiled
def _contact(c: Command, tip: Array, p: Parameters, tick_s: float) -> None:
    _axial(c, min(c.x[2] + p.con_speed * tick_s, tip[2] + LEAD_M), tick_s)
    _hold(c, p.con_k_xy, AXIAL_K, p.ins_k_rot, p.xi)


@compiled
def _insertion(
    c: Command, t_s: float, tip: Array, speed_z: float, p: Parameters, tick_s: float
) -> None:
    """Push, lead back to the axis, wiggle.

    The axial force is ``ins_push`` up to the speed ``ins_speed``, and less above it: never more.
    """
    for i in range(2):
        c.v[i] = _toward_zero(c.x[i], p.ins_speed, tick_s)
        c.w[i] = _toward_zero(c.turn[i], p.ins_rotspeed, tick_s)
        c.x[i] += c.v[i] * tick_s
        c.turn[i] += c.w[i] * tick_s
    c.x[2] = tip[2]
    c.v[2] = p.ins_speed
    c.drag[2] = BRAKE if speed_z > p.ins_speed else 0.0
    _hold(c, p.ins_k_xy, 0.0, p.ins_k_rot, p.xi)
    turn = 2.0 * math.pi * t_s
    c.wrench[0] = p.wig_a_x * math.sin(turn * p.wig_f_x)
    c.wrench[1] = p.wig_a_y * math.sin(turn * p.wig_f_y + p.wig_phi_y)
    c.wrench[2] = p.ins_push
    c.wrench[3] = p.wig_a_rx * math.sin(turn * p.wig_f_rx)
    c.wrench[4] = p.wig_a_ry * math.sin(turn * p.wig_f_ry + p.wig_phi_ry)


@compiled
def _extraction(c: Command, phase_ticks: int, tip: Array, tick_s: float) -> None:
    if phase_ticks == 0:
        c.x[:] = tip
    _axial(c, max(c.x[2] - EXTRACTION_SPEED * tick_s, tip[2] - LEAD_M), tick_s)
    _hold(c, APPROACH_K / 6.0, AXIAL_K, APPROACH_K_ROT / 6.0, APPROACH_XI)


@compiled
def _axial(c: Command, z: float, tick_s: float) -> None:
    """Move the axial reference to ``z``, with the speed that it truly has."""
    c.v[2] = (z - c.x[2]) / tick_s
    c.x[2] = z


@compiled
def _hold(c: Command, k_xy: float, k_z: float, k_rot: float, ratio: float) -> None:
    for i in range(3):
        c.stiffness[i] = k_z if i == 2 else k_xy
        c.stiffness[3 + i] = k_rot
    c.ratio[0] = ratio


@compiled
def _toward_zero(value: float, speed: float, tick_s: float) -> float:
    """Return the velocity that leads ``value`` to zero at ``speed`` and stays there."""
    return -math.copysign(min(speed, abs(value) / tick_s), value)
