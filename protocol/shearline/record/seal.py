"""Ends a part that was cut short, so that every MCAP tool reads it as a whole file.

A killed recorder or a full disk leaves a part without its summary, perhaps with half a chunk at
the end. Sealing keeps every whole chunk, cuts what is behind the last one, and writes the
summary that is missing. Nothing that can be read is ever changed.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import struct
import zlib
from collections import Counter
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    MessageIndex,
    Schema,
    Statistics,
)

from shearline.protocol.errors import RecordError
from shearline.record.frames import MAGIC, Frame, chunk_of, frames, records_of
from shearline.record.parts import parts

_FOOTER = struct.Struct("<BQQQ")


def seal(path: Path) -> bool:
    """Give a torn part its end; leave whole parts, and parts being written, alone.

    Returns:
        Whether the file was torn and is now whole (or, holding nothing, gone).

    Raises:
        OSError: If it cannot be opened or written.
    """
    with path.open("r+b") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        survey = _survey(file)
        if survey.whole:
            return False
        if not survey.chunks:
            path.unlink()
            return True
        file.truncate(survey.end)
        file.seek(survey.end)
        file.write(_tail(survey))
        file.flush()
        os.fsync(file.fileno())
    return True


def seal_all(run_dir: Path) -> int:
    """Seal every torn part of a run folder; return how many there were."""
    return sum(seal(path) for path in parts(run_dir))


@dataclass(slots=True)
class _Survey:
    """What a scan of the data section found; ``end`` is behind the last usable frame."""

    end: int = len(MAGIC)
    whole: bool = False
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    counts: Counter[int] = field(default_factory=Counter)
    last: frozenset[int] = frozenset()  # channels of the last chunk that could be read
    readable: bool = False  # whether the chunk just seen could be


def _survey(file: BinaryIO) -> _Survey:
    survey = _Survey()
    data_ended = False
    try:
        for frame in frames(file):
            data_ended = data_ended or frame.opcode == Opcode.DATA_END
            if not data_ended:
                _note(survey, frame)
        survey.whole = file.read(len(MAGIC)) == MAGIC
    except RecordError:
        survey.whole = False
        _drop_half_an_index(survey)
    return survey


def _note(survey: _Survey, frame: Frame) -> None:
    if frame.opcode == Opcode.CHUNK:
        survey.readable = False
        # a damaged chunk stays where it is, outside the index: what follows it is kept
        with contextlib.suppress(RecordError):
            _note_chunk(survey, frame)
            survey.readable = True
    elif frame.opcode == Opcode.MESSAGE_INDEX and survey.readable:
        index = MessageIndex.read(ReadDataStream(BytesIO(frame.payload)))
        chunk = survey.chunks[-1]
        chunk.message_index_offsets[index.channel_id] = frame.offset
        chunk.message_index_length += frame.end - frame.offset
    survey.end = frame.end


def _note_chunk(survey: _Survey, frame: Frame) -> None:
    found: Counter[int] = Counter()
    for record in records_of(frame):
        if isinstance(record, Schema):
            survey.schemas[record.id] = record
        elif isinstance(record, Channel):
            survey.channels[record.id] = record
        else:
            found[record.channel_id] += 1
    survey.counts += found
    survey.last = frozenset(found)
    chunk = chunk_of(frame)
    survey.chunks.append(
        ChunkIndex(
            chunk_length=frame.end - frame.offset,
            chunk_start_offset=frame.offset,
            compression=chunk.compression,
            compressed_size=len(chunk.data),
            message_end_time=chunk.message_end_time,
            message_index_length=0,
            message_index_offsets={},
            message_start_time=chunk.message_start_time,
            uncompressed_size=chunk.uncompressed_size,
        )
    )


def _drop_half_an_index(survey: _Survey) -> None:
    """Drop the index of the last chunk if it is cut: a reader would trust what is left of it."""
    if survey.readable and set(survey.chunks[-1].message_index_offsets) != survey.last:
        chunk = survey.chunks[-1]
        chunk.message_index_offsets.clear()
        chunk.message_index_length = 0
        survey.end = chunk.chunk_start_offset + chunk.chunk_length


def _tail(survey: _Survey) -> bytes:
    """Return data end, summary, footer and magic for what the survey found."""
    end = RecordBuilder()
    DataEnd(data_section_crc=0).write(end)
    data_end = end.end()
    summary = RecordBuilder()
    for record in (*survey.schemas.values(), *survey.channels.values()):
        record.write(summary)
    _statistics(survey).write(summary)
    for index in survey.chunks:
        index.write(summary)
    body = summary.end()
    start = survey.end + len(data_end)
    # the checksum covers the summary and the footer up to itself (MCAP specification, "Footer")
    crc = zlib.crc32(_FOOTER.pack(Opcode.FOOTER, 20, start, 0), zlib.crc32(body))
    footer = RecordBuilder()
    Footer(summary_start=start, summary_offset_start=0, summary_crc=crc).write(footer)
    return bytes(data_end + body + footer.end() + MAGIC)


def _statistics(survey: _Survey) -> Statistics:
    return Statistics(
        attachment_count=0,
        channel_count=len(survey.channels),
        channel_message_counts=dict(survey.counts),
        chunk_count=len(survey.chunks),
        message_count=sum(survey.counts.values()),
        message_end_time=max(chunk.message_end_time for chunk in survey.chunks),
        message_start_time=min(chunk.message_start_time for chunk in survey.chunks),
        metadata_count=0,
        schema_count=len(survey.schemas),
    )
