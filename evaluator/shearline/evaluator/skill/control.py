"""The control layer: a Cartesian impedance controller at 1 kHz.

tau = J^T (K e + D de + F) + N^T tau_n + bias, with torque and torque-rate limits of the arm
(Hogan 1985; Ott 2008). It receives commands and percepts, returns torques, and knows neither
phases nor plants nor parameters.

The external torque is a first-order low-pass of the torques with which the surroundings act on the
joints, as a momentum observer with an exact model would give it. Its band is part of the task:
a raw impact spikes over 10 N m on the wrist for two milliseconds.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from shearline.evaluator.skill.manipulation import Command
from shearline.sims.compiled import compiled
from shearline.sims.panda import JOINTS, RANGE, TORQUE_MAX, TORQUE_RATE_MAX, Array
from shearline.sims.plant import Percept
from shearline.sims.scene import Q_START, Pose

#: Corner frequency of the external torque estimate [Hz].
TAU_EXT_HZ = 15.0

#: Stiffness [N m/rad] and damping [N m s/rad] that hold the elbow, within the null space.
NULLSPACE_K = 10.0
NULLSPACE_D = 2.0

#: Effective masses of the arm at its start pose along the axes of the lock, for the damping design:
#: 1 / (J M^-1 J^T)_ii of the model in :mod:`shearline.sims.panda`. Translation [kg], rotation
#: [kg m^2].
DESIGN_MASS = (2.7, 2.1, 5.1, 0.15, 0.22, 0.08)

#: Keeps J J^T invertible at singular poses.
REGULARISATION = 1e-6


class Arm(NamedTuple):
    """Constants of the controlled arm and where it works.

    Attributes:
        torque_max: ``(7,)`` [N m].
        torque_step: Largest change of a torque in a tick [N m].
        q_rest: Posture that the null space is drawn to ``(7,)`` [rad].
        q_range: Joint limits ``(7, 2)`` [rad].
        mass: :data:`DESIGN_MASS` as an array ``(6,)``.
        origin: Of the believed lock in the base frame ``(3,)`` [m].
        axes: Rotation of the believed lock ``(3, 3)``.
        smoothing: Weight of the newest sample in the external torque.
    """

    torque_max: Array
    torque_step: float
    q_rest: Array
    q_range: Array
    mass: Array
    origin: Array
    axes: Array
    smoothing: float


class Feel(NamedTuple):
    """State and results of the controller; filled in place.

    Attributes:
        tau: Torque commanded last ``(7,)`` [N m].
        tau_ext: External torque, low-passed ``(7,)`` [N m].
        wrench: External force and torque on the tip in the frame of the believed lock ``(6,)``.
        tip: Tip in the frame of the believed lock ``(3,)`` [m].
        speed: Of the tip, translation and rotation, in that frame ``(6,)`` [m/s, rad/s].
        jacobian: In the frame of the believed lock ``(6, 7)``.
        factor: Cholesky factor of J J^T ``(6, 6)``.
    """

    tau: Array
    tau_ext: Array
    wrench: Array
    tip: Array
    speed: Array
    jacobian: Array
    factor: Array


def arm(believed: Pose, tick_s: float) -> Arm:
    """Return the Panda's constants for a lock believed to be at ``believed``."""
    return Arm(
        torque_max=TORQUE_MAX.copy(),
        torque_step=TORQUE_RATE_MAX * tick_s,
        q_rest=Q_START.copy(),
        q_range=RANGE.copy(),
        mass=np.array(DESIGN_MASS),
        origin=believed.position.copy(),
        axes=believed.rotation.copy(),
        smoothing=1.0 - math.exp(-2.0 * math.pi * TAU_EXT_HZ * tick_s),
    )


def empty_feel() -> Feel:
    """Return a controller at rest."""
    return Feel(
        tau=np.zeros(JOINTS),
        tau_ext=np.zeros(JOINTS),
        wrench=np.zeros(6),
        tip=np.zeros(3),
        speed=np.zeros(6),
        jacobian=np.zeros((6, JOINTS)),
        factor=np.zeros((6, 6)),
    )


@compiled
def feel(f: Feel, percept: Percept, arm: Arm) -> None:
    """Bring ``f`` up to date with a percept: external torque and wrench, tip, Jacobian."""
    for i in range(3):
        f.tip[i] = 0.0
        for k in range(3):
            f.tip[i] += arm.axes[k, i] * (percept.tip[k] - arm.origin[k])
        for j in range(JOINTS):
            translation = rotation = 0.0
            for k in range(3):
                translation += arm.axes[k, i] * percept.jacobian[k, j]
                rotation += arm.axes[k, i] * percept.jacobian[3 + k, j]
            f.jacobian[i, j] = translation
            f.jacobian[3 + i, j] = rotation
    for j in range(JOINTS):
        f.tau_ext[j] += arm.smoothing * (percept.contact[j] - f.tau_ext[j])
    _times_jacobian(f, percept.dq, f.speed)
    _factor(f)
    _times_jacobian(f, f.tau_ext, f.wrench)
    _solve(f, f.wrench)


@compiled
def control(f: Feel, percept: Percept, c: Command, arm: Arm) -> None:
    """Compute the torques ``f.tau`` of this tick.

    Args:
        f: Up to date, see :func:`feel`.
        percept: The present.
        c: What to do.
        arm: Constants.
    """
    wrench = np.empty(6)
    _impedance(f, percept, c, arm, wrench)
    rest = np.empty(JOINTS)
    for j in range(JOINTS):
        rest[j] = NULLSPACE_K * (arm.q_rest[j] - percept.q[j]) - NULLSPACE_D * percept.dq[j]
    felt = np.empty(6)
    _times_jacobian(f, rest, felt)
    _solve(f, felt)
    for j in range(JOINTS):
        torque = rest[j] + percept.bias[j]
        for i in range(6):
            torque += f.jacobian[i, j] * (wrench[i] - felt[i])
        f.tau[j] = _limited(torque, f.tau[j], arm.torque_max[j], arm.torque_step)


@compiled
def _impedance(f: Feel, percept: Percept, c: Command, arm: Arm, wrench: Array) -> None:
    """F = K e + D de + F_ff for each axis, with D = 2 xi sqrt(K m)."""
    e = np.empty(6)
    _turn_error(percept.rotation, arm.axes, c.turn, e)
    for i in range(3):
        e[i] = c.x[i] - f.tip[i]
    for i in range(6):
        wanted = c.v[i] if i < 3 else c.w[i - 3]
        damping = 2.0 * c.ratio[0] * math.sqrt(c.stiffness[i] * arm.mass[i])
        if i < 3:
            damping += c.drag[i]
        wrench[i] = c.stiffness[i] * e[i] + damping * (wanted - f.speed[i]) + c.wrench[i]


@compiled
def _turn_error(rotation: Array, axes: Array, turn: Array, e: Array) -> None:
    """e_rot = 1/2 sum_i r_i x r_d,i, in the frame of the believed lock (Luh 1980).

    The wanted rotation R_d = Rx(turn_x) Ry(turn_y) Rz(turn_z) relative to the lock.
    """
    ca, sa = math.cos(turn[0]), math.sin(turn[0])
    cb, sb = math.cos(turn[1]), math.sin(turn[1])
    cg, sg = math.cos(turn[2]), math.sin(turn[2])
    wanted = (
        (cb * cg, ca * sg + sa * sb * cg, sa * sg - ca * sb * cg),
        (-cb * sg, ca * cg - sa * sb * sg, sa * cg + ca * sb * sg),
        (sb, -sa * cb, ca * cb),
    )
    e[3] = e[4] = e[5] = 0.0
    for i in range(3):
        r0 = r1 = r2 = 0.0
        for k in range(3):
            r0 += axes[k, 0] * rotation[k, i]
            r1 += axes[k, 1] * rotation[k, i]
            r2 += axes[k, 2] * rotation[k, i]
        d0, d1, d2 = wanted[i]
        e[3] += 0.5 * (r1 * d2 - r2 * d1)
        e[4] += 0.5 * (r2 * d0 - r0 * d2)
        e[5] += 0.5 * (r0 * d1 - r1 * d0)


@compiled
def _limited(torque: float, last: float, largest: float, step: float) -> float:
    torque = min(max(torque, last - step), last + step)
    return min(max(torque, -largest), largest)


@compiled
def _times_jacobian(f: Feel, joints: Array, out: Array) -> None:
    for i in range(6):
        out[i] = 0.0
        for j in range(JOINTS):
            out[i] += f.jacobian[i, j] * joints[j]


@compiled
def _factor(f: Feel) -> None:
    """Cholesky factor L of J J^T, in place of ``f.factor``."""
    for i in range(6):
        for k in range(i + 1):
            total = REGULARISATION if i == k else 0.0
            for j in range(JOINTS):
                total += f.jacobian[i, j] * f.jacobian[k, j]
            for m in range(k):
                total -= f.factor[i, m] * f.factor[k, m]
            f.factor[i, k] = math.sqrt(total) if i == k else total / f.factor[k, k]


@compiled
def _solve(f: Feel, x: Array) -> None:
    """Solve J J^T y = x with the factor; ``x`` becomes ``y``."""
    for i in range(6):
        for k in range(i):
            x[i] -= f.factor[i, k] * x[k]
        x[i] /= f.factor[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            x[i] -= f.factor[k, i] * x[k]
        x[i] /= f.factor[i, i]
