"""The control layer on a robot: a command of the skill as a reference of its impedance controller.

The robot knows F = K clip(x_ref - x) - D v and no feed-forward wrench, so that a push or wiggle F
becomes a virtual displacement (F + D v) / K: the same force, as long as it is within the clip.
References move no faster than the lab allows, because a step of the reference is a blow.
Everything is in the frame of the believed lock.
"""

from __future__ import annotations

import numpy as np

from shearline.evaluator.robot.bounds import Bounds
from shearline.evaluator.robot.frames import in_lock
from shearline.evaluator.robot.port import Array, Clip, Contact
from shearline.evaluator.skill.control import DESIGN_MASS
from shearline.evaluator.skill.manipulation import AXIAL_K, Command

#: What the damping is designed for: the simulation's masses, but a unit along the axis, where the
#: reference has to lead by what the damping takes off [kg, kg m^2].
MASS = np.array([*DESIGN_MASS[:2], 1.0, *DESIGN_MASS[3:]])


def stiffness_of(c: Command) -> Array:
    """Return the stiffness ``(6,)`` that the robot is to hold a command with.

    An axis that the skill leaves to a force alone is held with :data:`AXIAL_K` about a reference
    that moves along with the tip.
    """
    held: Array = np.where(c.stiffness > 0.0, c.stiffness, AXIAL_K)
    return held


def damping_of(c: Command) -> Array:
    """Return the damping ``(6,)`` that the robot is to hold a command with."""
    damping: Array = 2.0 * c.ratio[0] * np.sqrt(stiffness_of(c) * MASS)
    return damping


def contact_of(c: Command, o_t_lock: Array, bounds: Bounds, t_max_s: float) -> Contact:
    """Return the stretch of impedance control that carries a command out."""
    limits = bounds.contact
    return Contact(
        o_r_c=o_t_lock[:3, :3].copy(),
        stiffness=stiffness_of(c),
        damping=damping_of(c),
        clip_m=limits.clip_m,
        clip_rad=limits.clip_rad,
        t_max_s=t_max_s,
    )


def target_of(c: Command, speed_z: float) -> Array:
    """Return where a command's reference would be without limits ``(6,)`` [m, rad].

    The robot brakes all motion, the skill only what differs from its own. So the reference leads by
    what the robot will take off: at the speed that is wanted, or, along an axis that is left to a
    force alone, at the speed that there is. Beyond the skill's own speed the robot's brake stays,
    for it acts at once.

    Args:
        c: The command.
        speed_z: Speed of the tip along the axis [m/s]; the skill brakes above its own.
    """
    stiffness, speed = stiffness_of(c), np.concatenate([c.v, c.w])
    if c.stiffness[2] == 0.0:
        speed[2] = min(speed_z, c.v[2])
    damping = damping_of(c)
    wrench = c.wrench + damping * speed
    wrench[2] += max(c.drag[2] - damping[2], 0.0) * (c.v[2] - speed_z)
    target: Array = np.concatenate([c.x, c.turn]) + wrench / stiffness
    return target


class Reference:
    """Follows a target no faster than it may.

    Args:
        bounds: The lab's.
        pace: Share of the lab's speed, (0, 1].
    """

    def __init__(self, bounds: Bounds, pace: float) -> None:
        limits = bounds.contact
        self._axes = np.eye(3)
        self._speed = np.array([limits.reference_mps] * 3 + [limits.reference_radps] * 3) * pace
        self._clip = np.array([limits.clip_m] * 3 + [limits.clip_rad] * 3)
        self._at = np.zeros(6)
        self.ticks = 0
        self.clipped = 0

    def reckon_with(self, clip: Clip, o_t_lock: Array) -> None:
        """Count by what a contact truly clips with, not by the lab's clip along the lock's axes."""
        self._axes = o_t_lock[:3, :3].T @ clip.o_r
        self._clip = np.array([clip.m] * 3 + [clip.rad] * 3)

    def begin(self, tip: Array, turn: Array) -> None:
        """Start where the tip ``(3,)`` and its turn ``(3,)`` are."""
        self._at = np.concatenate([tip, turn])

    def toward(self, target: Array, tip: Array, turn: Array, dt_s: float) -> None:
        """Move on by ``dt_s`` [s]; the length of the step is what is limited, not each axis.

        Args:
            target: Where the reference would be without limits ``(6,)`` [m, rad].
            tip: Where the tip is ``(3,)`` [m], from which the robot clips.
            turn: How it is turned ``(3,)`` [rad].
            dt_s: Time since the last step [s].
        """
        off = target - self._at
        error = (target - np.concatenate([tip, turn])).reshape(2, 3) @ self._axes
        cut = bool((np.abs(error.ravel()) > self._clip).any())
        for part, speed in ((slice(0, 3), self._speed[0]), (slice(3, 6), self._speed[3])):
            length = float(np.linalg.norm(off[part]))
            if length > speed * dt_s:
                off[part] *= speed * dt_s / length
                cut = True
        self._at = self._at + off
        self.ticks += 1
        self.clipped += cut

    def pose(self, o_t_lock: Array) -> Array:
        """Return the reference in the base frame ``(4, 4)``."""
        return in_lock(o_t_lock, self._at[:3], self._at[3:].tolist())

    @property
    def clipped_share(self) -> float:
        """Share of the ticks in which the skill asked for more than clip and speeds let through."""
        return self.clipped / max(self.ticks, 1)
