"""The command that makes the documentation's pictures."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from shearline.sims.render import RenderError, choose_backend


def _can_draw() -> bool:
    before = os.environ.get("MUJOCO_GL")
    try:
        choose_backend()
    except RenderError as error:
        return "too early" in str(error)
    finally:
        os.environ.pop("MUJOCO_GL", None)
        if before is not None:
            os.environ["MUJOCO_GL"] = before
    return True


@pytest.mark.slow
@pytest.mark.skipif(not _can_draw(), reason="neither EGL nor OSMesa on this machine")
def test_the_pictures_are_made_and_are_small(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    command = [sys.executable, "-m", "shearline.evaluator.skill.pictures", "--out", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    assert set(sizes) == {"keylock-scene.png", "keylock-cut.png", "keylock-trial.png"}
    assert all(10_000 < size < 200_000 for size in sizes.values())


def test_without_a_way_to_draw_the_command_says_so_in_one_sentence(tmp_path: Path) -> None:
    code = (
        "import ctypes.util, sys; ctypes.util.find_library = lambda name: None;"
        "from shearline.evaluator.skill.pictures import main;"
        f"sys.exit(main(['--out', {str(tmp_path)!r}]))"
    )
    environment = {k: v for k, v in os.environ.items() if k != "MUJOCO_GL"}
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=environment
    )
    assert found.returncode == 4
    assert found.stderr.count("\n") == 1
    assert "install libosmesa6" in found.stderr
