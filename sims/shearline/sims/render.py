"""Pictures of a scene by MuJoCo, without a screen: the whole of it, or the lock cut open.

A :class:`Stage` draws one view as often as wanted, for a film; :func:`draw_scene` and
:func:`draw_cut` draw it once. Needs EGL or OSMesa from the system; where neither is found,
:class:`RenderError` says so. Knows no skill: whoever has joint angles and pin positions can have
them drawn.
"""

from __future__ import annotations

import ctypes.util
import os
import struct
import sys
import zlib
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from shearline.protocol.errors import ShearlineError
from shearline.sims.lock import CUT
from shearline.sims.panda import Array

if TYPE_CHECKING:
    from shearline.sims.mujoco_plant import MujocoPlant
    from shearline.sims.plant import Setup

Image = npt.NDArray[np.uint8]

_BACKENDS = (("egl", "EGL"), ("osmesa", "OSMesa"))


class RenderError(ShearlineError):
    """No picture can be made on this machine."""


def choose_backend() -> str:
    """Choose how MuJoCo draws; must run before the first import of ``mujoco``.

    Returns:
        Value of ``MUJOCO_GL``, which is set if it was not.

    Raises:
        RenderError: If the system has neither EGL nor OSMesa, or mujoco is already there.
    """
    if "MUJOCO_GL" in os.environ:
        return os.environ["MUJOCO_GL"]
    found = [name for name, library in _BACKENDS if ctypes.util.find_library(library)]
    if not found:
        raise RenderError(
            "expected EGL or OSMesa to draw without a screen, found neither:"
            " install libosmesa6 (or libegl1) with the system's package manager"
        )
    if "mujoco" in sys.modules:
        raise RenderError(f"mujoco was imported too early: set MUJOCO_GL={found[-1]} beforehand")
    os.environ["MUJOCO_GL"] = found[-1]
    return found[-1]


@dataclass(frozen=True, slots=True)
class Camera:
    """Where a picture is taken from.

    Attributes:
        look_at: Point in the middle of the picture [m].
        distance_m: From there to the camera [m].
        azimuth_deg: About the upright axis [deg].
        elevation_deg: Negative looks down [deg].
        cut: Whether the lock is cut open towards the camera.
        shadow: Whether things cast shadows; costs more than all the rest.
    """

    look_at: tuple[float, float, float]
    distance_m: float
    azimuth_deg: float
    elevation_deg: float
    cut: bool = False
    shadow: bool = False


#: The whole arm in front of the lock.
WHOLE = Camera((0.30, 0.0, 0.36), 1.75, 140.0, -18.0, shadow=True)


def into_lock(setup: Setup) -> Camera:
    """Return the camera that looks into the opened lock of a trial."""
    x, y, z = (float(value) for value in setup.lock.position)
    return Camera((x, y, z - 0.006), 0.095, 90.0, 0.0, cut=True)


class Stage:
    """One view of a plant, drawn as often as wanted; use it as a context.

    Args:
        plant: Its state is overwritten by :meth:`draw`; reset it with the trial's setup first.
        camera: Where from.
        width: [pixels], at most 1280.
        height: [pixels], at most 960.

    Raises:
        RenderError: If MuJoCo cannot draw on this machine.
    """

    def __init__(self, plant: MujocoPlant, camera: Camera, width: int, height: int) -> None:
        import mujoco  # noqa: PLC0415 - only after choose_backend

        self._plant = plant
        self._camera = camera
        self._view, self._options = _view(camera)
        self._hidden = {plant.model.geom(name).id for name in CUT} if camera.cut else set()
        try:
            self._renderer = mujoco.Renderer(plant.model, height, width)
        except Exception as error:
            raise RenderError(f"MuJoCo could not open an offscreen picture: {error}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        where: TracebackType | None,
    ) -> None:
        self._renderer.close()

    def draw(self, qpos: Array) -> Image:
        """Return a picture ``(height, width, 3)`` at joint angles and pin positions ``(12,)``."""
        import mujoco  # noqa: PLC0415 - only after choose_backend

        plant, scene = self._plant, self._renderer.scene
        plant.data.qpos[:] = qpos
        mujoco.mj_forward(plant.model, plant.data)
        self._renderer.update_scene(plant.data, self._view, self._options)
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = self._camera.shadow
        for drawn in scene.geoms[: scene.ngeom]:
            if drawn.objtype == mujoco.mjtObj.mjOBJ_GEOM and drawn.objid in self._hidden:
                drawn.rgba[3] = 0.0
        image: Image = self._renderer.render().copy()
        return image


def draw_scene(plant: MujocoPlant, setup: Setup, width: int = 640, height: int = 640) -> Image:
    """Return a picture ``(height, width, 3)`` of the scene at the start of a trial."""
    plant.reset(setup)
    with Stage(plant, WHOLE, width, height) as stage:
        return stage.draw(plant.data.qpos.copy())


def draw_cut(
    plant: MujocoPlant, setup: Setup, qpos: Array, width: int = 300, height: int = 420
) -> Image:
    """Return a picture ``(height, width, 3)`` into the opened lock.

    Args:
        plant: Its state is overwritten.
        setup: Where the lock is.
        qpos: Joint angles and pin positions ``(12,)``.
        width: [pixels].
        height: [pixels].
    """
    plant.reset(setup)
    with Stage(plant, into_lock(setup), width, height) as stage:
        return stage.draw(qpos)


def write_png(path: Path, image: Image) -> None:
    """Write an image ``(height, width, 3)`` as PNG, each row as differences to its left."""
    height, width, _ = image.shape
    left = np.zeros_like(image)
    left[:, 1:] = image[:, :-1]
    rows = np.concatenate(
        [np.ones((height, 1), np.uint8), (image - left).reshape(height, width * 3)], axis=1
    )
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(rows.tobytes(), 9)
    chunks = _chunk(b"IHDR", head) + _chunk(b"IDAT", body) + _chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


def _chunk(kind: bytes, body: bytes) -> bytes:
    check = zlib.crc32(kind + body)
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", check)


def _view(camera: Camera) -> tuple[Any, Any]:
    """Return MuJoCo's camera and its choice of what is drawn: all but what only collides."""
    import mujoco  # noqa: PLC0415 - only after choose_backend

    view = mujoco.MjvCamera()
    view.type = mujoco.mjtCamera.mjCAMERA_FREE
    view.lookat[:] = camera.look_at
    view.distance, view.azimuth, view.elevation = (
        camera.distance_m,
        camera.azimuth_deg,
        camera.elevation_deg,
    )
    options = mujoco.MjvOption()
    options.geomgroup[:] = (1, 1, 1, 1, 0, 0)
    return view, options
