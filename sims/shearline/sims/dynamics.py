"""The arm's equations of motion, compiled: pose and Jacobian of the tip, Newton and Euler.

For plants whose engine does not hand them out cheaply. Link frames are Craig's, as in
:mod:`shearline.sims.panda`; hand and key are one body with the last link, unless the key turns
between the fingers: then two more joints follow.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from shearline.sims import panda
from shearline.sims.compiled import compiled
from shearline.sims.hold import TO_TIP, Hold
from shearline.sims.panda import Array
from shearline.sims.scene import KEY_INERTIA, KEY_MASS, KEY_TURN, TIP_M, Pose, Scene

GRAVITY = 9.81

#: Rotations whose z axis, about which every joint turns, is the x and the y axis of the frame.
_ABOUT_X: Array = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_ABOUT_Y: Array = _ABOUT_X.T.copy()


class Chain(NamedTuple):
    """The arm as arrays, of n joints: 7, or 9 where the grasp gives.

    Attributes:
        offset: Of each joint in the frame of the link before it ``(n, 3)`` [m].
        twist: Rotation from there to the joint at angle 0 ``(n, 3, 3)``.
        mass: Of each link ``(n,)`` [kg].
        centre: Its centre of mass in its frame ``(n, 3)`` [m].
        inertia: About that centre ``(n, 3, 3)`` [kg m^2].
        tip: Of the key in the frame of the last link ``(3,)`` [m].
        turn: Of the key in that frame ``(3, 3)``.
    """

    offset: Array
    twist: Array
    mass: Array
    centre: Array
    inertia: Array
    tip: Array
    turn: Array


class Body(NamedTuple):
    """A rigid body: mass [kg], centre ``(3,)`` [m], inertia about it ``(3, 3)`` [kg m^2]."""

    mass: float
    centre: Array
    inertia: Array

    def placed(self, pose: Pose) -> Body:
        """Return the body in the frame in which its own frame has this pose."""
        turn = pose.rotation
        return Body(self.mass, pose.position + turn @ self.centre, turn @ self.inertia @ turn.T)


def chain(scene: Scene, hold: Hold | None = None) -> Chain:
    """Return the arm that holds the scene's key.

    Args:
        scene: With the key.
        hold: How the fingers hold it; ``None``: hand and key are one piece.
    """
    bodies = [Body(link.mass, np.array(link.centre), _tensor(link.inertia)) for link in panda.LINKS]
    hand = Body(panda.HAND_MASS, np.array(panda.HAND_CENTRE), np.diag(panda.HAND_INERTIA))
    flange = Pose(np.array([0.0, 0.0, panda.FLANGE_M]), panda.rotation_z(-np.pi / 4.0))
    bow = np.array([0.0, 0.0, -scene.lock.key.length_m])
    key = Body(KEY_MASS, bow, np.diag(KEY_INERTIA))
    offset = [np.array(panda.link_offset(link)) for link in panda.LINKS]
    twist = [panda.rotation_x(link.alpha) for link in panda.LINKS]
    fixed = [bodies.pop(), hand.placed(flange)]
    if hold is None:
        tip = Pose(np.array([0.0, 0.0, panda.FLANGE_M + TIP_M]), panda.rotation_z(KEY_TURN))
    else:
        tip = hold.middle.moved(TO_TIP, np.zeros(3))
    if hold is None or not hold.hinges:
        bodies.append(joined((*fixed, key.placed(tip))))
    else:
        tip = Pose(_ABOUT_Y.T @ TO_TIP, _ABOUT_Y.T)
        offset += [hold.middle.position, np.zeros(3)]
        twist += [hold.middle.rotation @ _ABOUT_X, _ABOUT_X.T @ _ABOUT_Y]
        about_x, about_y = (hinge.added for hinge in hold.hinges)
        key = key._replace(inertia=key.inertia + np.diag([0.0, about_y, about_y]))
        bodies += [joined(fixed), Body(0.0, np.zeros(3), about_x * np.eye(3)), key.placed(tip)]
    return Chain(
        offset=np.array(offset),
        twist=np.array(twist),
        mass=np.array([body.mass for body in bodies]),
        centre=np.array([body.centre for body in bodies]),
        inertia=np.array([body.inertia for body in bodies]),
        tip=tip.position,
        turn=np.ascontiguousarray(tip.rotation),  # another layout would be compiled for anew
    )


def joined(bodies: Iterable[Body]) -> Body:
    """Return bodies that stand still to each other as one (Steiner's theorem)."""
    bodies = list(bodies)
    mass = sum(body.mass for body in bodies)
    centre = sum((body.mass * body.centre for body in bodies), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        arm = body.centre - centre
        inertia += body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Body(mass, centre, inertia)


@compiled
def forward(c: Chain, q: Array, tip: Array, rotation: Array, jacobian: Array) -> None:
    """Fill the pose of the tip and its Jacobian, all in the base frame.

    Args:
        c: The arm.
        q: Joint angles ``(n,)`` [rad].
        tip: Position ``(3,)`` [m].
        rotation: Of the key ``(3, 3)``.
        jacobian: Translation first ``(6, n)``.
    """
    at, turn, frame = np.zeros(3), np.eye(3), np.empty((3, 3))
    anchor, axis = np.empty((len(q), 3)), np.empty((len(q), 3))
    for j in range(len(q)):
        _joint_frame(c, j, q[j], frame)
        _add_turned(turn, c.offset[j], at)
        _multiply_in_place(turn, frame)
        for i in range(3):
            anchor[j, i], axis[j, i] = at[i], turn[i, 2]
    _add_turned(turn, c.tip, at)
    _multiply_in_place(turn, c.turn)
    tip[:] = at
    rotation[:] = turn
    for j in range(len(q)):
        ax, ay, az = axis[j]
        rx, ry, rz = at[0] - anchor[j, 0], at[1] - anchor[j, 1], at[2] - anchor[j, 2]
        jacobian[0, j] = ay * rz - az * ry
        jacobian[1, j] = az * rx - ax * rz
        jacobian[2, j] = ax * ry - ay * rx
        jacobian[3, j], jacobian[4, j], jacobian[5, j] = ax, ay, az


@compiled
def inverse(c: Chain, q: Array, dq: Array, ddq: Array, tau: Array) -> None:
    """Fill the torques ``tau (n,)`` that move the links so, gravity included.

    Newton and Euler, outward for motions, inward for forces, each in the link's own frame (Luh,
    Walker and Paul 1980; Craig's form). Rotor inertia and joint friction are not part of it.

    Args:
        c: The arm.
        q: Joint angles ``(n,)`` [rad].
        dq: Their speeds ``(n,)`` [rad/s].
        ddq: Their accelerations ``(n,)`` [rad/s^2].
        tau: Torques [N m].
    """
    joints = len(q)
    frames = np.empty((joints, 3, 3))
    forces, moments = np.empty((joints, 3)), np.empty((joints, 3))
    w, dw, dv = np.zeros(3), np.zeros(3), np.array([0.0, 0.0, GRAVITY])
    for j in range(joints):
        _joint_frame(c, j, q[j], frames[j])
        dv = _turned_back(frames[j], dv + _arc(w, dw, c.offset[j]))
        w, dw = _turned_back(frames[j], w), _turned_back(frames[j], dw)
        dw[0] += w[1] * dq[j]
        dw[1] -= w[0] * dq[j]
        dw[2] += ddq[j]
        w[2] += dq[j]
        forces[j] = c.mass[j] * (dv + _arc(w, dw, c.centre[j]))
        moments[j] = _turned(c.inertia[j], dw) + _cross(w, _turned(c.inertia[j], w))
        moments[j] += _cross(c.centre[j], forces[j])
    f, n = np.zeros(3), np.zeros(3)
    for k in range(joints):
        j = joints - 1 - k
        f, n = f + forces[j], n + moments[j]
        tau[j] = n[2]
        f, n = _turned(frames[j], f), _turned(frames[j], n)
        n = n + _cross(c.offset[j], f)


@compiled
def _joint_frame(c: Chain, j: int, angle: float, frame: Array) -> None:
    """Fill the rotation from the link before joint ``j`` to the one after it."""
    cos, sin = np.cos(angle), np.sin(angle)
    for i in range(3):
        x, y = c.twist[j, i, 0], c.twist[j, i, 1]
        frame[i, 0] = x * cos + y * sin
        frame[i, 1] = y * cos - x * sin
        frame[i, 2] = c.twist[j, i, 2]


@compiled
def _arc(w: Array, dw: Array, arm: Array) -> Array:
    """Return the acceleration of a point at ``arm`` on a turning body, relative to its frame."""
    return _cross(dw, arm) + _cross(w, _cross(w, arm))


@compiled
def _cross(a: Array, b: Array) -> Array:
    out = np.empty(3)
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


@compiled
def _turned(frame: Array, x: Array) -> Array:
    out = np.empty(3)
    for i in range(3):
        out[i] = frame[i, 0] * x[0] + frame[i, 1] * x[1] + frame[i, 2] * x[2]
    return out


@compiled
def _turned_back(frame: Array, x: Array) -> Array:
    out = np.empty(3)
    for i in range(3):
        out[i] = frame[0, i] * x[0] + frame[1, i] * x[1] + frame[2, i] * x[2]
    return out


@compiled
def _add_turned(frame: Array, x: Array, out: Array) -> None:
    """Add ``frame @ x`` to ``out``."""
    for i in range(3):
        out[i] += frame[i, 0] * x[0] + frame[i, 1] * x[1] + frame[i, 2] * x[2]


@compiled
def _multiply_in_place(a: Array, b: Array) -> None:
    """Make ``a`` the product ``a @ b``."""
    for i in range(3):
        x, y, z = a[i, 0], a[i, 1], a[i, 2]
        for k in range(3):
            a[i, k] = x * b[0, k] + y * b[1, k] + z * b[2, k]


def _tensor(values: tuple[float, ...]) -> Array:
    xx, yy, zz, xy, xz, yz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
