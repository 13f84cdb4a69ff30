"""How the bodies of a scene move in one trial: poses in their parents' frames, from a trace.

Pure arithmetic on columns; whether a viewer or a file takes the poses is not known here.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.protocol.pose import Placed
from shearline.protocol.scene import Body, Joint, SceneData

Array = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Motion:
    """Where one body is over time, in its parent's frame.

    Attributes:
        body: The body.
        position: ``(samples, 3)`` [m].
        quaternion: ``(samples, 4)``, x, y, z, w.
    """

    body: Body
    position: Array
    quaternion: Array


def paths(scene: SceneData) -> dict[str, str]:
    """Return where each body stands in the tree, e.g. ``{"hand": "link1/hand"}``."""
    found = {"": ""}
    for body in scene.bodies:
        above = found.get(body.parent, "")
        found[body.name] = f"{above}/{body.name}" if above else body.name
    return found


def moving(scene: SceneData, columns: Mapping[str, Array]) -> list[Motion]:
    """Return how each body moves whose column is there; the others stand where the scene says.

    Args:
        scene: What there is.
        columns: Column name to values ``(samples,)``, in rad or m.
    """
    free = [body for body in scene.bodies if body.column in columns]
    hinges = [body for body in free if body.joint is Joint.HINGE]
    slides = [body for body in free if body.joint is Joint.SLIDE]
    motions = [_slid(body, columns[body.column]) for body in slides]
    if hinges:
        motions += _turned(hinges, np.stack([columns[body.column] for body in hinges]))
    return motions


def _slid(body: Body, shift_m: Array) -> Motion:
    along = _along(tuple(body.quaternion), tuple(body.axis))
    position = np.array(body.position) + np.outer(shift_m, along)
    quaternion = np.tile(np.array(body.quaternion, dtype=np.float32), (len(shift_m), 1))
    return Motion(body, position.astype(np.float32), quaternion)


@functools.lru_cache(maxsize=256)
def _along(quaternion: tuple[float, ...], axis: tuple[float, ...]) -> npt.NDArray[np.float64]:
    """Return where a slide leads; the same in every trial, and dear as numpy goes."""
    return turned(quaternion, axis)


def _turned(bodies: list[Body], angle: Array) -> list[Motion]:
    """Turn all bodies by ``angle (bodies, samples)`` [rad] at once."""
    samples = angle.shape[1]
    at_zero = np.repeat([body.quaternion for body in bodies], samples, axis=0)
    axes = np.repeat([body.axis for body in bodies], samples, axis=0)
    turns = product(at_zero, about(axes, angle.ravel())).astype(np.float32)
    turns = turns.reshape(len(bodies), samples, 4)
    places = [np.tile(np.array(body.position, dtype=np.float32), (samples, 1)) for body in bodies]
    return [Motion(body, p, q) for body, p, q in zip(bodies, places, turns, strict=True)]


def standing(scene: SceneData, placed: Sequence[Placed]) -> Iterator[Placed]:
    """Yield where every body stands while its joint is at zero, in this trial."""
    own = {place.body: place for place in placed}
    for body in scene.bodies:
        default = Placed(body=body.name, position=body.position, quaternion=body.quaternion)
        yield own.get(body.name, default)


def about(axis: npt.ArrayLike, angle: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return the quaternions ``(n, 4)`` of turns by ``angle (n,)`` [rad] about ``axis (n, 3)``."""
    half = np.asarray(angle, dtype=np.float64) / 2.0
    axes = np.asarray(axis, dtype=np.float64)
    unit = axes / np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-12)
    return np.concatenate([unit * np.sin(half)[:, None], np.cos(half)[:, None]], axis=1)


def product(p: npt.ArrayLike, q: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return Hamilton's product ``p q`` of quaternions ``(n, 4)``: first ``q``, then ``p``."""
    px, py, pz, pw = np.asarray(p, dtype=np.float64).T
    qx, qy, qz, qw = np.asarray(q, dtype=np.float64).T
    return np.stack(
        [
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
            pw * qw - px * qx - py * qy - pz * qz,
        ],
        axis=1,
    )


def turned(quaternion: npt.ArrayLike, vector: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return a vector ``(3,)`` after a turn by one quaternion ``(4,)``."""
    q = np.asarray(quaternion, dtype=np.float64)
    v = np.asarray(vector, dtype=np.float64)
    shifted = 2.0 * np.cross(q[:3], v)
    result: npt.NDArray[np.float64] = v + q[3] * shifted + np.cross(q[:3], shifted)
    return result
