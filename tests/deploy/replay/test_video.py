"""A film of a replayed trial: every view of it shows something, and the key moves."""

from __future__ import annotations

import ctypes.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from shearline.evaluator.replay.film import HEIGHT, WIDTH, Film
from shearline.evaluator.replay.strip import CAPTION_HEIGHT
from shearline.evaluator.replay.strip import HEIGHT as STRIP_HEIGHT
from shearline.evaluator.replay.video import FPS, encoder

CAN_DRAW = any(map(ctypes.util.find_library, ("EGL", "OSMesa")))
MAIN = "import sys; from shearline.deploy.cli import main; sys.exit(main(sys.argv[1:]))"

pytest.importorskip("imageio_ffmpeg", reason="no ffmpeg here: pip install 'shearline[video]'")


def replay(*words: object, code: str = MAIN) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    return subprocess.run(
        [sys.executable, "-c", code, "replay", *map(str, words)],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
        timeout=120,
    )


def decoded(path: Path) -> np.ndarray:
    raw = subprocess.run(
        [encoder(), "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    ).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, HEIGHT, WIDTH, 3)


@pytest.mark.slow
@pytest.mark.skipif(not CAN_DRAW, reason="neither EGL nor OSMesa on this machine")
def test_a_film_shows_arm_lock_and_curves(keylock_run: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.mp4"
    done = replay(keylock_run, "--trial", 0, "--video", path, "--speed", 8)
    assert done.returncode == 0, done.stderr
    assert f"a film of 1 s is in {path}" in done.stderr
    film = decoded(path)
    assert FPS < len(film) < 2 * FPS
    first, last = film[0].astype(int), film[-1].astype(int)
    views = slice(CAPTION_HEIGHT, HEIGHT - STRIP_HEIGHT)
    for part in (first[:CAPTION_HEIGHT], first[views, :740], first[views, 740:], first[-160:]):
        assert part.std() > 5.0
    moved = np.abs(first - last).max(axis=2) > 60
    assert moved[views, 740:].mean() > 0.01  # the key, in the lock that is cut open
    assert moved[views, :740].mean() > 0.001  # the hand
    assert not moved[: CAPTION_HEIGHT - 4].any()


def test_where_nothing_can_be_drawn_one_sentence_says_so(sphere_run: Path, tmp_path: Path) -> None:
    code = f"import ctypes.util; ctypes.util.find_library = lambda name: None; {MAIN}"
    done = replay(sphere_run, "--trial", 0, "--video", tmp_path / "x.mp4", code=code)
    assert done.returncode == 4
    assert done.stderr.count("\n") == 1
    assert "install libosmesa6" in done.stderr


def test_a_task_without_a_scene_cannot_be_filmed(sphere_run: Path, tmp_path: Path) -> None:
    done = replay(sphere_run, "--trial", 0, "--video", tmp_path / "x.mp4")
    assert done.returncode in {2, 4}
    assert done.stderr.count("\n") == 1
    if CAN_DRAW:
        assert "expected a task with a scene (keylock, keylock-limit, keylock-jam)" in done.stderr


def test_a_film_has_a_picture_for_each_thirtieth_of_a_second(keylock_run: Path) -> None:
    from shearline.deploy.replay.recorded import Recorded, load  # noqa: PLC0415 - loads mujoco
    from shearline.evaluator.replay import again  # noqa: PLC0415
    from shearline.record.reader import open_run  # noqa: PLC0415

    case = Recorded(open_run(keylock_run)).case(0)
    replayed = again(load("keylock"), case)
    assert replayed.verdict.trace is not None
    end_s = float(replayed.verdict.trace.t_s[-1])
    for speed in (0.1, 1.0):
        seconds = len(Film(replayed, speed)) / FPS
        assert seconds == pytest.approx(end_s / speed + 1.0, abs=2 / FPS)
