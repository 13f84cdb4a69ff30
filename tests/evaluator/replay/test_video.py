"""A film holds the pictures that were written, and where none can be made one sentence says why."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from shearline.evaluator.replay import video
from shearline.evaluator.replay.video import Image, VideoError, check_path, encoder, write
from shearline.protocol.errors import ConfigError

WIDTH, HEIGHT = 96, 64

pytest.importorskip("imageio_ffmpeg", reason="no ffmpeg here: pip install 'shearline[video]'")


def pictures(count: int) -> Iterator[Image]:
    """Grey that grows lighter from picture to picture."""
    for i in range(count):
        yield np.full((HEIGHT, WIDTH, 3), 20 + 20 * i, np.uint8)


def decoded(path: Path) -> Image:
    raw = subprocess.run(
        [encoder(), "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    ).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, HEIGHT, WIDTH, 3)


def test_a_film_holds_its_pictures_in_order(tmp_path: Path) -> None:
    assert write(tmp_path / "x.mp4", pictures(10), WIDTH, HEIGHT) == 10
    film = decoded(tmp_path / "x.mp4")
    assert len(film) == 10
    written = np.stack(list(pictures(10))).astype(int)
    assert abs(film.astype(int) - written).max() <= 4


def test_a_film_replaces_what_stood_there(tmp_path: Path) -> None:
    path = tmp_path / "x.mp4"
    path.write_text("not a film")
    write(path, pictures(2), WIDTH, HEIGHT)
    assert len(decoded(path)) == 2


def test_a_name_that_looks_like_an_option_or_a_protocol_is_a_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write(Path("-y:x.mp4"), pictures(2), WIDTH, HEIGHT)
    assert (tmp_path / "-y:x.mp4").stat().st_size > 100


def test_where_nothing_can_be_written_one_sentence_says_so(tmp_path: Path) -> None:
    (tmp_path / "x.mp4").mkdir()
    for path in (tmp_path / "x.mp4", tmp_path / "none" / "y.mp4"):
        with pytest.raises(VideoError, match=r"[xy]\.mp4 could not be written: .*irectory"):
            write(path, pictures(3), WIDTH, HEIGHT)


def test_an_error_while_drawing_leaves_the_film_of_yesterday(tmp_path: Path) -> None:
    def broken() -> Iterator[Image]:
        yield from pictures(1)
        raise ZeroDivisionError

    (tmp_path / "x.mp4").write_text("a film of yesterday")
    with pytest.raises(ZeroDivisionError):
        write(tmp_path / "x.mp4", broken(), WIDTH, HEIGHT)
    assert [path.name for path in tmp_path.iterdir()] == ["x.mp4"]
    assert (tmp_path / "x.mp4").read_text() == "a film of yesterday"


def test_pictures_of_another_size_are_no_film(tmp_path: Path) -> None:
    with pytest.raises(VideoError, match="could not be written"):
        write(tmp_path / "x.mp4", [np.zeros((3, 3, 3), np.uint8)], WIDTH, HEIGHT)


@pytest.mark.parametrize(("name", "said"), [("x.gif", r"end in \.mp4"), ("no/x.mp4", "a folder")])
def test_a_place_where_no_film_can_be_is_refused(tmp_path: Path, name: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        check_path(tmp_path / name)
    check_path(tmp_path / "x.mp4")


def test_without_an_encoder_one_sentence_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(ConfigError, match=r"pip install 'shearline\[video\]'"):
        video.encoder()
