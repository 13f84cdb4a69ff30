"""A study's results on disk: one JSON line for each repeat, appended whole or not at all.

It is what makes a study resumable: what it holds need not be run again. It knows no run.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Self

import msgspec

from shearline.protocol.errors import RecordError
from shearline.studies.repeat import Job, Repeat

_decoder = msgspec.json.Decoder(Repeat)


class Store:
    """The repeats of one study, held by one process at a time.

    Args:
        path: The file; made if missing. A last line that a crash cut short is removed.

    Raises:
        RecordError: If it cannot be used, is held by another process, or is something else.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._kept: dict[Job, Repeat] = {}
        self._seen: set[tuple[str, int]] = set()
        self._fd = _open(path)
        try:
            self._read()
        except BaseException:
            self.close()
            raise

    def add(self, repeats: Iterable[Repeat]) -> list[Repeat]:
        """Append those that are new, by run and trial, and return them.

        Of two repeats of one job the later counts. All are on disk when this returns.

        Raises:
            RecordError: If they could not be written.
        """
        new = [one for one in repeats if (one.run, one.trial) not in self._seen]
        data = b"".join(msgspec.json.encode(one) + b"\n" for one in new)
        end = os.lseek(self._fd, 0, os.SEEK_END)
        try:
            while data:
                data = data[os.write(self._fd, data) :]
            os.fdatasync(self._fd)
        except OSError as fault:
            os.ftruncate(self._fd, end)  # half a line would spoil the next one
            raise _unusable(self.path, fault) from None
        for one in new:
            self._keep(one)
        return new

    def __contains__(self, job: Job) -> bool:
        return job in self._kept

    def __getitem__(self, job: Job) -> Repeat:
        return self._kept[job]

    def __iter__(self) -> Iterator[Repeat]:
        return iter(self._kept.values())

    def close(self) -> None:
        """Give the file back."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _read(self) -> None:
        data = self.path.read_bytes()
        whole = data.rfind(b"\n") + 1
        if whole < len(data):
            os.ftruncate(self._fd, whole)
        for number, line in enumerate(data[:whole].splitlines(), start=1):
            try:
                self._keep(_decoder.decode(line))
            except (msgspec.DecodeError, UnicodeDecodeError) as fault:
                raise RecordError(
                    f"line {number} of {self.path} is no repeat ({fault}):"
                    " correct it, or choose another folder"
                ) from None

    def _keep(self, one: Repeat) -> None:
        self._kept[one.job] = one
        self._seen.add((one.run, one.trial))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _open(path: Path) -> int:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o644)
    except OSError as fault:
        raise _unusable(path, fault) from None
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(fd)
        raise RecordError(
            f"another study is at work in {path.parent}: wait for it, or choose another folder"
        ) from None
    return fd


def _unusable(path: Path, fault: OSError) -> RecordError:
    return RecordError(f"cannot use the results {path}: {fault.strerror}: correct the folder")
