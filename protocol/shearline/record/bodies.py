"""How the bodies of a scene move in one trial: poses in their parents' frames, from a trace.

Pure arithmetic on columns; whether a viewer or a file takes the poses is not known here.
"""

from __future__ import annotations

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


def moving(scene: SceneData, columns: Mapping[str, Array]) -> Iterator[Motion]:
    """Yield how each body moves whose column is there; the others stand where the scene says.

    Args:
        scene: What there is.
        columns: Column name to values ``(samples,)``, in rad or m.
    """
    for body in scene.bodies:
        values = columns.get(body.column)
        if values is None or body.joint is Joint.FIXED:
            continue
        position = np.tile(np.array(body.position), (len(values), 1))
        quaternion = np.tile(np.array(body.quaternion), (len(values), 1))
        if body.joint is Joint.SLIDE:
            position += np.outer(values, turned(body.quaternion, body.axis))
        else:
            quaternion = product(quaternion, about(body.axis, values))
        yield Motion(body, position.astype(np.float32), quaternion.astype(np.float32))


def standing(scene: SceneData, placed: Sequence[Placed]) -> Iterator[Placed]:
    """Yield where every body stands while its joint is at zero, in this trial."""
    own = {place.body: place for place in placed}
    for body in scene.bodies:
        default = Placed(body=body.name, position=body.position, quaternion=body.quaternion)
        yield own.get(body.name, default)


def about(axis: npt.ArrayLike, angle: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return the quaternions ``(n, 4)`` of turns by ``angle (n,)`` [rad] about one axis."""
    half = np.asarray(angle, dtype=np.float64) / 2.0
    unit = np.asarray(axis, dtype=np.float64)
    unit = unit / max(float(np.linalg.norm(unit)), 1e-12)
    return np.concatenate([np.outer(np.sin(half), unit), np.cos(half)[:, None]], axis=1)


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
