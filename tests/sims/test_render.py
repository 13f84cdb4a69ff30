"""Pictures: a PNG that others read, and a clear word where none can be made."""

from __future__ import annotations

import ctypes.util
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from shearline.sims.render import RenderError, choose_backend, write_png


def test_a_png_holds_the_pixels_that_were_written(tmp_path: Path) -> None:
    image = np.random.default_rng(0).integers(0, 256, (5, 7, 3), dtype=np.uint8)
    write_png(tmp_path / "x.png", image)
    data = (tmp_path / "x.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", data[16:24]) == (7, 5)
    size = struct.unpack(">I", data[33:37])[0]
    rows = np.frombuffer(zlib.decompress(data[41 : 41 + size]), np.uint8).reshape(5, 22)
    assert rows[:, 0].tolist() == [1] * 5
    pixels = np.cumsum(rows[:, 1:].reshape(5, 7, 3), axis=1, dtype=np.uint8)
    np.testing.assert_array_equal(pixels, image)


def test_without_egl_and_osmesa_one_sentence_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(ctypes.util, "find_library", lambda _: None)
    with pytest.raises(RenderError, match="install libosmesa6"):
        choose_backend()


def test_a_backend_that_was_chosen_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "egl")
    assert choose_backend() == "egl"
