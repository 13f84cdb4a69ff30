"""Pictures of a scene by MuJoCo, without a screen: the whole of it, or the lock cut open.

Needs EGL or OSMesa from the system; where neither is found, :class:`RenderError` says so. Knows no
skill: whoever has joint angles and pin positions can have them drawn.
"""

from __future__ import annotations

import ctypes.util
import os
import struct
import sys
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from shearline.protocol.errors import ShearlineError
from shearline.sims.panda import Array

if TYPE_CHECKING:
    from shearline.sims.mujoco_plant import MujocoPlant
    from shearline.sims.plant import Setup

Image = npt.NDArray[np.uint8]

#: Sides of the lock that are left out when it is cut open: those towards the camera.
_CUT = ("wall_xp", "face_xp", "edge_xp")

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


def draw_scene(plant: MujocoPlant, setup: Setup, width: int = 640, height: int = 640) -> Image:
    """Return a picture ``(height, width, 3)`` of the scene at the start of a trial."""
    plant.reset(setup)
    return _draw(plant, (0.30, 0.0, 0.36), (1.75, 140.0, -18.0), (height, width), shadow=True)


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
    plant.data.qpos[:] = qpos
    kept = plant.model.geom_rgba.copy()
    for name in _CUT:
        plant.model.geom(name).rgba[3] = 0.0
    x, y, z = setup.lock.position - 0.006 * np.array([0.0, 0.0, 1.0])
    image = _draw(plant, (x, y, z), (0.095, 90.0, 0.0), (height, width), shadow=False)
    plant.model.geom_rgba[:] = kept
    return image


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


def _draw(
    plant: MujocoPlant,
    look_at: tuple[float, float, float],
    view: tuple[float, float, float],
    size: tuple[int, int],
    *,
    shadow: bool,
) -> Image:
    """Draw from ``(distance [m], azimuth [deg], elevation [deg])`` around ``look_at`` [m]."""
    import mujoco  # noqa: PLC0415 - only after choose_backend

    mujoco.mj_forward(plant.model, plant.data)
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = look_at
    camera.distance, camera.azimuth, camera.elevation = view
    options = mujoco.MjvOption()
    options.geomgroup[:] = (1, 1, 1, 1, 0, 0)
    try:
        renderer = mujoco.Renderer(plant.model, *size)
    except Exception as error:
        raise RenderError(f"MuJoCo could not open an offscreen picture: {error}") from error
    with renderer:
        renderer.update_scene(plant.data, camera, options)
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadow
        image: Image = renderer.render().copy()
    return image
