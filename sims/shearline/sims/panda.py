"""The Franka Emika Panda as plain numbers: kinematics, limits, masses.

Sources: DH table, joint, torque and torque-rate limits from the manufacturer's data sheet
(Franka Control Interface documentation, "Robot and interface specifications"); link masses,
centres of mass and inertias as identified by Gaz, Cognetti, Oliva, Robuffo Giordano and De Luca,
"Dynamic identification of the Franka Emika Panda robot with retrieval of feasible parameters
using penalty-based optimization", IEEE RA-L 4(4), 2019. Reflected rotor inertia and viscous
friction are not published; the values here are plausible guesses and said to be so.

Nothing here knows an engine: :mod:`shearline.sims.scene` turns these numbers into MJCF.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: Joints of the arm.
JOINTS = 7

#: Torque may change by this much in a second [N m/s].
TORQUE_RATE_MAX = 1000.0

#: Guess: reflected rotor inertia of each joint [kg m^2].
ARMATURE = 0.1

#: Guess: viscous friction of each joint [N m s/rad].
DAMPING = 0.3

#: Distance from the axis of joint 7 to the flange along z [m].
FLANGE_M = 0.107

#: Gripper on the flange, turned by -45 degrees about z: mass [kg], centre [m], inertia [kg m^2].
HAND_MASS = 0.73
HAND_CENTRE = (-0.01, 0.0, 0.03)
HAND_INERTIA = (0.001, 0.0025, 0.0017)

#: From the flange to the point between the finger tips along z [m].
HAND_REACH_M = 0.1034


@dataclass(frozen=True, slots=True)
class Link:
    """One joint and the link it moves.

    Attributes:
        name: ``"link1"`` to ``"link7"``.
        a: Craig's DH parameter: distance along the previous x axis [m].
        d: Distance along the joint axis [m].
        alpha: Twist about the previous x axis [rad].
        range_rad: Smallest and largest joint angle [rad].
        speed_max: Largest joint speed [rad/s].
        torque_max: Largest torque [N m].
        mass: [kg].
        centre: Centre of mass in the link frame [m].
        inertia: xx, yy, zz, xy, xz, yz about the centre, in the link frame [kg m^2].
    """

    name: str
    a: float
    d: float
    alpha: float
    range_rad: tuple[float, float]
    speed_max: float
    torque_max: float
    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]


_Q = math.pi / 2.0

LINKS: tuple[Link, ...] = (
    Link(
        "link1", 0.0, 0.333, 0.0, (-2.8973, 2.8973), 2.175, 87.0, 4.970684,
        (0.003875, 0.002081, -0.04762),
        (0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169),
    ),
    Link(
        "link2", 0.0, 0.0, -_Q, (-1.7628, 1.7628), 2.175, 87.0, 0.646926,
        (-0.003141, -0.02872, 0.003495),
        (0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704),
    ),
    Link(
        "link3", 0.0, 0.316, _Q, (-2.8973, 2.8973), 2.175, 87.0, 3.228604,
        (0.027518, 0.039252, -0.066502),
        (0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805),
    ),
    Link(
        "link4", 0.0825, 0.0, _Q, (-3.0718, -0.0698), 2.175, 87.0, 3.587895,
        (-0.05317, 0.104419, 0.027454),
        (0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641),
    ),
    Link(
        "link5", -0.0825, 0.384, -_Q, (-2.8973, 2.8973), 2.61, 12.0, 1.225946,
        (-0.011953, 0.041065, -0.038437),
        (0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229),
    ),
    Link(
        "link6", 0.0, 0.0, _Q, (-0.0175, 3.7525), 2.61, 12.0, 1.666555,
        (0.060149, -0.014117, -0.010517),
        (0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341),
    ),
    Link(
        "link7", 0.088, 0.0, _Q, (-2.8973, 2.8973), 2.61, 12.0, 0.735522,
        (0.010517, -0.004252, 0.061597),
        (0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741),
    ),
)  # fmt: skip

#: Torque limits of the joints ``(7,)`` [N m].
TORQUE_MAX: Array = np.array([link.torque_max for link in LINKS])

#: Joint limits ``(7, 2)`` [rad].
RANGE: Array = np.array([link.range_rad for link in LINKS])


def rotation_x(angle: float) -> Array:
    """Return the rotation ``(3, 3)`` about x by ``angle`` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle: float) -> Array:
    """Return the rotation ``(3, 3)`` about y by ``angle`` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle: float) -> Array:
    """Return the rotation ``(3, 3)`` about z by ``angle`` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def link_offset(link: Link) -> tuple[float, float, float]:
    """Return where the joint sits in the frame of the link before it [m]."""
    return (link.a, -math.sin(link.alpha) * link.d, math.cos(link.alpha) * link.d)


def flange_pose(q: npt.ArrayLike) -> tuple[Array, Array]:
    """Return position ``(3,)`` [m] and rotation ``(3, 3)`` of the flange in the base frame.

    Args:
        q: Joint angles ``(7,)`` [rad].
    """
    position, rotation = np.zeros(3), np.eye(3)
    for link, angle in zip(LINKS, np.asarray(q, dtype=np.float64), strict=True):
        position = position + rotation @ np.array(link_offset(link))
        rotation = rotation @ rotation_x(link.alpha) @ rotation_z(float(angle))
    return position + rotation @ np.array([0.0, 0.0, FLANGE_M]), rotation
