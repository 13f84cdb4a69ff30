"""What must survive ``kill -9`` at the robot: a folder of small files beside the bounds file.

Whether the key may be in the lock, how worn key and lock are, where the lock is, logs of trials
that reached no verdict, and a diary of who did what. Each file is replaced whole and reaches the
disk before the call returns. One process holds the folder at a time.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import time
from pathlib import Path
from typing import IO, Annotated, Any, TypeVar

import msgspec
import numpy as np
from msgspec import Meta

from shearline.evaluator.robot.bounds import ToolTable, WearTable
from shearline.evaluator.robot.errors import RobotRefused
from shearline.evaluator.robot.frames import is_pose
from shearline.evaluator.robot.port import Array

K = TypeVar("K")
M = TypeVar("M")

#: Logs of aborted trials that are kept; the oldest go first.
LOGS_MAX = 200


class Wear(msgspec.Struct, frozen=True):
    """How often a key and a lock were used, by name, and trials since the last canary."""

    insertions: dict[str, int] = {}
    since_canary: int = 0

    def used(self, *names: str) -> Wear:
        """Return the wear after one more insertion of the things named."""
        counts = {name: self.insertions.get(name, 0) + 1 for name in names}
        return Wear(self.insertions | counts, self.since_canary + 1)

    def replaced(self, name: str) -> Wear:
        """Return the wear after a thing was replaced by a new one of the same name."""
        return Wear(self.insertions | {name: 0}, self.since_canary)

    def tested(self) -> Wear:
        """Return the wear after a canary."""
        return Wear(self.insertions, 0)


def worn(wear: Wear, limits: WearTable) -> str:
    """Name what has done its insertions, or ``""``."""
    for name, most in (
        (limits.key, limits.key_insertions),
        (limits.lock, limits.lock_insertions),
    ):
        done = wear.insertions.get(name, 0)
        if done >= most:
            return f"{name} has done {done} insertions of {most}"
    return ""


class Store:
    """The robot's folder.

    Args:
        folder: Is made if missing.

    Raises:
        RobotRefused: If another process holds it, or it cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._lock: IO[str] = (folder / "held").open("w")
        except OSError as fault:
            raise RobotRefused(f"the robot's folder {folder} cannot be written: {fault}") from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise RobotRefused(
                f"another process works with {folder}: one evaluator a robot, end that one first"
            ) from None

    def close(self) -> None:
        """Let the folder go."""
        self._lock.close()

    # -- the key ---------------------------------------------------------------------------------

    @property
    def key_in_lock(self) -> bool:
        """Whether the key may be in the lock; said before it can be, unsaid once it is out."""
        return (self.folder / "key-in-lock").exists()

    def mark_key(self, why: str) -> None:
        """Say that the key may be in the lock from now on."""
        write(self.folder / "key-in-lock", why.encode())

    def clear_key(self) -> None:
        """Say that it is out."""
        (self.folder / "key-in-lock").unlink(missing_ok=True)
        sync(self.folder)

    # -- wear ------------------------------------------------------------------------------------

    def wear(self) -> Wear:
        """Return how worn key and lock are.

        Raises:
            RobotRefused: If the file is damaged: nobody knows then.
        """
        return self._read("wear.json", Wear, Wear())

    def set_wear(self, wear: Wear) -> None:
        """Replace it."""
        write(self.folder / "wear.json", msgspec.json.encode(wear))

    # -- the lock's pose -------------------------------------------------------------------------

    def calibration(self) -> Calibration | None:
        """Return where the lock is, ``None`` if nobody has shown it yet.

        Raises:
            RobotRefused: If the file is damaged.
        """
        found = self._read("calibration.json", Calibration, None)
        if found is not None and not is_pose(found.pose()):
            raise RobotRefused(
                f"the lock's pose in {self.folder / 'calibration.json'} is no pose:"
                " run this command with --calibrate again"
            )
        return found

    def set_calibration(self, calibration: Calibration) -> None:
        """Replace it."""
        write(self.folder / "calibration.json", msgspec.json.encode(calibration))

    # -- what happened ---------------------------------------------------------------------------

    def note(self, what: str, **facts: Any) -> None:
        """Add a line to the diary; a disk that is full is no reason to leave a motion."""
        line = json.dumps({"at": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "what": what} | facts)
        with contextlib.suppress(OSError), (self.folder / "diary.jsonl").open("a") as diary:
            diary.write(line + "\n")

    def keep_log(self, name: str, log: Array) -> Path:
        """Keep the log of a trial that reached no verdict; return where."""
        folder = self.folder / "logs"
        folder.mkdir(exist_ok=True)
        kept = sorted(folder.glob("*.npy"), key=lambda path: path.stat().st_mtime)
        for old in kept[: max(0, len(kept) - LOGS_MAX + 1)]:
            old.unlink(missing_ok=True)
        path = folder / f"{name}.npy"
        np.save(path, log)
        return path

    def _read(self, name: str, kind: type[K], missing: M) -> K | M:
        path = self.folder / name
        try:
            return msgspec.json.decode(path.read_bytes(), type=kind)
        except FileNotFoundError:
            return missing
        except (OSError, msgspec.MsgspecError) as fault:
            raise RobotRefused(f"{path} is damaged ({fault}): restore it or remove it") from None


class Calibration(msgspec.Struct, frozen=True, kw_only=True):
    """Where the lock is.

    Attributes:
        o_t_lock: Pose of the lock's frame in the base frame, 16 numbers row after row: origin in
            the mouth, z into the lock.
        spread_m: Largest distance of a repeat from their mean [m].
        spread_rad: Largest angle of a repeat from their mean [rad].
        repeats: How often it was shown.
        at: When.
        tool: What hung on the flange; with another one the hand shows another pose.
        seated_m: How deep the tip was taken to be [m].
    """

    o_t_lock: Annotated[tuple[float, ...], Meta(min_length=16, max_length=16)]
    spread_m: float
    spread_rad: float
    repeats: int
    at: str
    tool: ToolTable
    seated_m: float

    def pose(self) -> Array:
        """Return the lock's pose ``(4, 4)``."""
        return np.array(self.o_t_lock).reshape(4, 4)


def write(path: Path, data: bytes) -> None:
    """Replace a file whole, on disk when this returns."""
    beside = path.with_name(f".{path.name}.new")
    with beside.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)
    sync(path.parent)


def sync(folder: Path) -> None:
    """Have a folder's names reach the disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
