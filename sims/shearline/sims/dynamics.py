"""The arm's equations of motion, compiled: pose and Jacobian of the tip, Newton and Euler.

For plants whose engine does not hand them out cheaply. Link frames are Craig's, as in
:mod:`shearline.sims.panda`; hand and key are one body with the last link.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from shearline.sims import panda
from shearline.sims.compiled import compiled
from shearline.sims.panda import JOINTS, Array
from shearline.sims.scene import KEY_INERTIA, KEY_MASS, KEY_TURN, TIP_M, Scene

GRAVITY = 9.81


class Chain(NamedTuple):
    """The arm as arrays.

    Attributes:
        offset: Of each joint in the frame of the link before it ``(7, 3)`` [m].
        twist: Rotation from there to the joint at angle 0 ``(7, 3, 3)``.
        mass: Of each link ``(7,)`` [kg].
        centre: Its centre of mass in its frame ``(7, 3)`` [m].
        inertia: About that centre ``(7, 3, 3)`` [kg m^2].
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


def chain(scene: Scene) -> Chain:
    """Return the arm that holds the scene's key."""
    bodies = [Body(link.mass, np.array(link.centre), _tensor(link.inertia)) for link in panda.LINKS]
    hand = panda.rotation_z(-np.pi / 4.0)
    turn = panda.rotation_z(KEY_TURN)
    tip = np.array([0.0, 0.0, panda.FLANGE_M + TIP_M])
    bow = tip - np.array([0.0, 0.0, scene.lock.key.length_m])
    held = Body(
        panda.HAND_MASS,
        np.array([0.0, 0.0, panda.FLANGE_M]) + hand @ np.array(panda.HAND_CENTRE),
        hand @ np.diag(panda.HAND_INERTIA) @ hand.T,
    )
    key = Body(KEY_MASS, bow, turn @ np.diag(KEY_INERTIA) @ turn.T)
    bodies[-1] = joined((bodies[-1], held, key))
    return Chain(
        offset=np.array([panda.link_offset(link) for link in panda.LINKS]),
        twist=np.array([panda.rotation_x(link.alpha) for link in panda.LINKS]),
        mass=np.array([body.mass for body in bodies]),
        centre=np.array([body.centre for body in bodies]),
        inertia=np.array([body.inertia for body in bodies]),
        tip=tip,
        turn=turn,
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
        q: Joint angles ``(7,)`` [rad].
        tip: Position ``(3,)`` [m].
        rotation: Of the key ``(3, 3)``.
        jacobian: Translation first ``(6, 7)``.
    """
    at, turn, frame = np.zeros(3), np.eye(3), np.empty((3, 3))
    anchor, axis = np.empty((JOINTS, 3)), np.empty((JOINTS, 3))
    for j in range(JOINTS):
        _joint_frame(c, j, q[j], frame)
        _add_turned(turn, c.offset[j], at)
        _multiply_in_place(turn, frame)
        for i in range(3):
            anchor[j, i], axis[j, i] = at[i], turn[i, 2]
    _add_turned(turn, c.tip, at)
    _multiply_in_place(turn, c.turn)
    tip[:] = at
    rotation[:] = turn
    for j in range(JOINTS):
        ax, ay, az = axis[j]
        rx, ry, rz = at[0] - anchor[j, 0], at[1] - anchor[j, 1], at[2] - anchor[j, 2]
        jacobian[0, j] = ay * rz - az * ry
        jacobian[1, j] = az * rx - ax * rz
        jacobian[2, j] = ax * ry - ay * rx
        jacobian[3, j], jacobian[4, j], jacobian[5, j] = ax, ay, az


@compiled
def inverse(c: Chain, q: Array, dq: Array, ddq: Array, tau: Array) -> None:
    """Fill the torques ``tau (7,)`` that move the links so, gravity included.

    Newton and Euler, outward for motions, inward for forces, each in the link's own frame (Luh,
    Walker and Paul 1980; Craig's form). Rotor inertia and joint friction are not part of it.

    Args:
        c: The arm.
        q: Joint angles ``(7,)`` [rad].
        dq: Their speeds ``(7,)`` [rad/s].
        ddq: Their accelerations ``(7,)`` [rad/s^2].
        tau: Torques [N m].
    """
    frames = np.empty((JOINTS, 3, 3))
    forces, moments = np.empty((JOINTS, 3)), np.empty((JOINTS, 3))
    w, dw, dv = np.zeros(3), np.zeros(3), np.array([0.0, 0.0, GRAVITY])
    for j in range(JOINTS):
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
    for k in range(JOINTS):
        j = JOINTS - 1 - k
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
