r"""The journal: an append-only file of checksummed entries, the truth of a run.

Each record is a length, a CRC-32 and one msgpack map. What :meth:`Journal.append` has returned
from survives ``kill -9``; with ``durable`` it survives a power cut. A torn or damaged tail is cut
off when the journal is opened for writing, and merely ends what a reader sees. One learner at a
time holds the file. It knows how to keep entries, not what they mean.

The file is: ``b"SHEARJ1\n"``, then per record ``length`` and ``crc32`` as little-endian uint32
and ``length`` bytes of msgpack.
"""

from __future__ import annotations

import fcntl
import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Self

import msgspec

from shearline.learner.dispatcher.entries import AnyEntry, Entry
from shearline.protocol.errors import RecordError

MAGIC = b"SHEARJ1\n"

#: One entry holds at most an episode's proposals; more is damage, not data.
RECORD_BYTES_MAX = 1 << 30

_HEAD = struct.Struct("<II")
_encoder = msgspec.msgpack.Encoder()
_decoder = msgspec.msgpack.Decoder(AnyEntry)


class Journal:
    """A journal open for writing, locked against other learners.

    Args:
        path: The file; created if missing.
        durable: Wait for the disk at each append.

    Attributes:
        entries: What it held when it was opened, to be replayed.
        torn_bytes: Bytes cut off its end because they were damaged; 0 if it was whole.

    Raises:
        RecordError: If it cannot be opened, is held by another learner, or is no journal.
    """

    def __init__(self, path: Path, *, durable: bool = False) -> None:
        self.path = path
        self.durable = durable
        self._fd = _open(path)
        try:
            data = path.read_bytes()
            self.entries, whole = _parse(data, path)
            self.torn_bytes = len(data) - whole
            self._start(whole)
        except OSError as fault:
            os.close(self._fd)
            raise _unusable(path, fault) from None
        except RecordError:
            os.close(self._fd)
            raise

    def append(self, entries: Iterable[Entry], *, sync: bool = False) -> None:
        """Write entries in one go; on return they survive the process.

        Args:
            entries: In order.
            sync: Wait for the disk even if the journal is not durable.

        Raises:
            RecordError: If they could not be written whole; nothing that rests on them may then
                be told to anyone.
        """
        data = b"".join(map(_pack, entries))
        try:
            _write_all(self._fd, data)
            if sync or self.durable:
                os.fdatasync(self._fd)
        except OSError as fault:
            # Half a record would hide whatever a later start writes behind it.
            os.ftruncate(self._fd, self._end)
            os.lseek(self._fd, self._end, os.SEEK_SET)
            raise RecordError(
                f"cannot write the journal {self.path}: {fault.strerror}:"
                " make room, then start the learner on this folder again"
            ) from None
        self._end += len(data)

    def close(self) -> None:
        """Give the file back."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _start(self, whole: int) -> None:
        """Cut damage off the end, and begin the file if it is new."""
        if self.torn_bytes:
            os.ftruncate(self._fd, whole)
        os.lseek(self._fd, whole, os.SEEK_SET)
        self._end = whole
        if whole == 0:
            _write_all(self._fd, MAGIC)
            self._end = len(MAGIC)
            _sync_folder(self.path.parent)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read(path: Path) -> Iterator[AnyEntry]:
    """Yield the entries of a journal up to the first damaged record; it may still be growing.

    Raises:
        RecordError: If it cannot be read or is no journal.
    """
    try:
        data = path.read_bytes()
    except OSError as fault:
        raise _unusable(path, fault) from None
    entries, _ = _parse(data, path)
    yield from entries


def _open(path: Path) -> int:
    try:
        fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as fault:
        raise _unusable(path, fault) from None
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(fd)
        raise RecordError(
            f"another learner is running on {path.parent}: stop it, or choose another folder"
        ) from None
    return fd


def _parse(data: bytes, path: Path) -> tuple[list[AnyEntry], int]:
    """Return the whole entries and where the last of them ends."""
    if not MAGIC.startswith(data[: len(MAGIC)]):
        raise RecordError(f"{path} is not a journal of this version: choose another folder")
    if len(data) < len(MAGIC):
        return [], 0
    entries: list[AnyEntry] = []
    at = len(MAGIC)
    while (record := _record(data, at)) is not None:
        try:
            entries.append(_decoder.decode(record))
        except (msgspec.DecodeError, UnicodeDecodeError) as fault:
            raise RecordError(
                f"{path} holds an entry that this version does not know ({fault}):"
                " use the version of Shearline that wrote it"
            ) from None
        at += _HEAD.size + len(record)
    return entries, at


def _record(data: bytes, at: int) -> bytes | None:
    """Return the record that starts there, or nothing if it is not whole."""
    if at + _HEAD.size > len(data):
        return None
    length, crc = _HEAD.unpack_from(data, at)
    record = data[at + _HEAD.size : at + _HEAD.size + length]
    if not 0 < length <= RECORD_BYTES_MAX or len(record) < length or zlib.crc32(record) != crc:
        return None
    return record


def _pack(entry: Entry) -> bytes:
    record = _encoder.encode(entry)
    return _HEAD.pack(len(record), zlib.crc32(record)) + record


def _write_all(fd: int, data: bytes) -> None:
    while data:
        data = data[os.write(fd, data) :]


def _sync_folder(folder: Path) -> None:
    """Have the disk keep a new file's name, not only its contents."""
    fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)


def _unusable(path: Path, fault: OSError) -> RecordError:
    return RecordError(f"cannot use the journal {path}: {fault.strerror}: correct the run folder")
