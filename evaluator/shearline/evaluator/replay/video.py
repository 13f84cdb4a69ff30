"""Pictures become a film: H.264 in an MP4, which every browser and slide plays.

The encoder is ffmpeg as a program of its own, the one that the package ``imageio-ffmpeg`` brings
(or the system's, by its ``IMAGEIO_FFMPEG_EXE``). It is GPL software; frames go to it through a pipe
and nothing of it is loaded here. What is in the pictures is no concern of this file.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from shearline.protocol.errors import ConfigError, ShearlineError

Image = npt.NDArray[np.uint8]

#: Frames of a film for each of its seconds [1/s].
FPS = 30

#: Constant quality of x264: 0 is lossless, 51 the worst; 20 shows no blocks on flat ground.
_CRF = 20


class VideoError(ShearlineError):
    """A film could not be written."""


def check_path(path: Path) -> None:
    """Raise if no film can be written to ``path``.

    Raises:
        ConfigError: If it does not end in ``.mp4`` or its folder is not there.
    """
    if path.suffix.lower() != ".mp4":
        raise ConfigError(f"expected a film's name to end in .mp4, got {path}")
    if not path.resolve().parent.is_dir():
        raise ConfigError(f"expected a folder to write {path.name} to, found none at {path.parent}")


def encoder() -> str:
    """Return the path of ffmpeg.

    Raises:
        ConfigError: If there is none.
    """
    try:
        from imageio_ffmpeg import get_ffmpeg_exe  # noqa: PLC0415 - only films need it

        return str(get_ffmpeg_exe())
    except (ModuleNotFoundError, RuntimeError):
        raise ConfigError(
            "expected ffmpeg to make a film, found none: pip install 'shearline[video]'"
        ) from None


def write(path: Path, frames: Iterable[Image], width: int, height: int) -> int:
    """Write a film and return how many frames it has.

    Args:
        path: Ends in ``.mp4``; what stands there is replaced.
        frames: Pictures ``(height, width, 3)``.
        width: Even [pixels].
        height: Even [pixels].

    Raises:
        ConfigError: If there is no ffmpeg.
        VideoError: If ffmpeg fails.
    """
    # A film that was not finished must not stand where a whole one is expected.
    part = path.with_name(f".{path.name}.part.mp4")
    try:
        count = _encode([encoder(), *_arguments(part, width, height)], frames)
        part.replace(path)
    except (_EncoderError, OSError) as error:
        raise VideoError(f"{path} could not be written: {error}") from None
    finally:
        part.unlink(missing_ok=True)
    return count


class _EncoderError(Exception):
    """What ffmpeg said last."""


def _encode(command: list[str], frames: Iterable[Image]) -> int:
    count = 0
    with tempfile.TemporaryFile() as words:
        process = subprocess.Popen(  # noqa: S603 - the encoder we depend on, our own arguments
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=words
        )
        with process:  # closes the pipe and waits
            assert process.stdin is not None
            try:
                for frame in frames:
                    process.stdin.write(np.ascontiguousarray(frame).data)
                    count += 1
            except BrokenPipeError:
                pass  # its last words say why
            except BaseException:
                process.kill()
                raise
        words.seek(0)
        said = words.read().decode(errors="replace").strip().splitlines()
    if process.returncode != 0:
        raise _EncoderError(said[-1] if said else "ffmpeg failed without a word")
    return count


def _arguments(path: Path, width: int, height: int) -> list[str]:
    frames = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(FPS)]
    # 4:2:0 and the index in front: what players and browsers insist on.
    film = ["-c:v", "libx264", "-crf", str(_CRF), "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    return ["-y", "-v", "error", *frames, "-i", "-", "-an", *film, f"file:{path}"]
