"""The frame structure of an MCAP file: where each record starts, and where the file is torn.

A frame is one byte of opcode, eight of length, and the payload. This module finds whole frames
and opens chunks; it knows nothing of topics or messages, and never writes.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import BinaryIO, TypeAlias

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Message, Schema, Statistics
from mcap.stream_reader import breakup_chunk

from shearline.protocol.errors import RecordError

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
#: No frame of ours comes near: a chunk closes at 1 MiB and a trace is capped on the wire.
FRAME_BYTES_MAX = 256 * 2**20

#: Exact length of the records that end a file [bytes]: a chunk whose opcode lost a bit must not
#: pass for one, or all behind it would be missing without a word.
ENDINGS = {int(Opcode.DATA_END): 4, int(Opcode.FOOTER): 20}

#: What the libraries below raise for damaged bytes: lz4 a RuntimeError, mcap a ValueError for a
#: wrong checksum, and lengths that are nonsense end in the last two.
_DAMAGE = (
    McapError,
    zstandard.ZstdError,
    RuntimeError,
    ValueError,
    struct.error,
    OverflowError,
    MemoryError,
)

ChunkRecord: TypeAlias = Schema | Channel | Message


@dataclass(frozen=True, slots=True)
class Frame:
    """One whole frame.

    Attributes:
        offset: Of its opcode in the file.
        opcode: What kind of record it is.
        payload: The record without its opcode and length.
    """

    offset: int
    opcode: int
    payload: bytes

    @property
    def end(self) -> int:
        """Offset just behind it."""
        return self.offset + HEAD.size + len(self.payload)


def frames(file: BinaryIO) -> Iterator[Frame]:
    """Yield the whole frames of an open file from its start, the footer last.

    Raises:
        RecordError: At the first byte that does not belong to a whole frame: the magic is
            wrong, or the file ends without a footer.
    """
    if file.read(len(MAGIC)) != MAGIC:
        raise RecordError("it does not begin like an MCAP file")
    offset = len(MAGIC)
    while True:
        frame = frame_at(file, offset)
        yield frame
        if frame.opcode == Opcode.FOOTER:
            return
        offset = frame.end


def frame_at(file: BinaryIO, offset: int) -> Frame:
    """Return the whole frame that begins at ``offset``.

    Raises:
        RecordError: If the file ends before the frame does, or it poses as an ending.
    """
    file.seek(offset)
    head = file.read(HEAD.size)
    opcode, length = HEAD.unpack(head) if len(head) == HEAD.size else (0, 0)
    if opcode == 0 or length > FRAME_BYTES_MAX:
        raise RecordError(f"it breaks off at byte {offset}")
    payload = file.read(length)
    if len(payload) < length:
        raise RecordError(f"it breaks off at byte {offset}")
    if length != ENDINGS.get(opcode, length):
        raise RecordError(f"the record at byte {offset} is damaged (an ending of {length} bytes)")
    return Frame(offset, opcode, payload)


def chunk_of(frame: Frame) -> Chunk:
    """Parse the head of a chunk; its contents stay compressed.

    Raises:
        RecordError: If it is damaged.
    """
    try:
        return Chunk.read(ReadDataStream(BytesIO(frame.payload)))
    except _DAMAGE as error:
        raise RecordError(f"the chunk at byte {frame.offset} is damaged ({error})") from error


def records_of(frame: Frame) -> list[ChunkRecord]:
    """Return the schemas, channels and messages of a chunk whose checksum is right.

    Raises:
        RecordError: If the chunk is damaged.
    """
    chunk = chunk_of(frame)
    try:
        found = breakup_chunk(chunk, validate_crc=True)
    except _DAMAGE as error:
        raise RecordError(f"the chunk at byte {frame.offset} is damaged ({error})") from error
    return [record for record in found if isinstance(record, (Schema, Channel, Message))]


def chunks_in(frame: Frame) -> int:
    """Return how many chunks the statistics of a file claim.

    Raises:
        RecordError: If they are damaged.
    """
    try:
        return int(Statistics.read(ReadDataStream(BytesIO(frame.payload))).chunk_count)
    except _DAMAGE as error:
        raise RecordError(f"the statistics are damaged ({error})") from error
