"""Writes the record: one MCAP part after another, readable at any moment up to half a second ago.

Chunks close by time as well as by size and go straight to the file, so that a killed process
loses next to nothing. When the disk is full, writing stops with one sentence and nothing raises:
the run is worth more than its record. The writer knows topics and files; it does not know where
messages come from, and time is handed in.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import sys
import tomllib
import zlib
from collections import defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, Message, MessageIndex
from mcap.writer import CompressionType, Writer

from shearline.protocol import messages
from shearline.protocol.errors import RecordError
from shearline.protocol.messages import TraceData
from shearline.protocol.scene import SceneData
from shearline.record import foxglove, schemas
from shearline.record.entities import scene_update
from shearline.record.goal import Goal
from shearline.record.parts import create_next
from shearline.record.seal import seal
from shearline.record.topics import (
    FIXED_TOPIC,
    LOG_TOPIC,
    SCENE_TOPIC,
    STANDARD,
    TF_TOPIC,
    TIP_TOPIC,
    TOPICS,
    RunConfig,
    Topic,
)
from shearline.record.transforms import ROOT, fixed_transforms, motion

#: A chunk closes at this size or age; age bounds what a kill loses, size bounds memory.
CHUNK_BYTES = 2**20
CHUNK_AGE_NS = 500_000_000
#: A third of the processor time of Zstandard, for a fifth more bytes: a run pays in time.
COMPRESSION = CompressionType.LZ4
#: A new part begins behind this size, so that no single file becomes unwieldy.
PART_BYTES_MAX = 2**30
#: Kept free beside the record while it is written: room to end it properly on a full disk.
RESERVE_BYTES = 2**20


class RecordWriter:
    """Writes messages to the record of one run folder.

    Args:
        run_dir: The run folder; must exist.
        config: Written at the head of every part.
        part_bytes_max: Size behind which a new part begins [bytes].
        complain: Called with one sentence when writing stops.

    Raises:
        RecordError: If the first part cannot be created.
    """

    def __init__(
        self,
        run_dir: Path,
        config: RunConfig,
        *,
        part_bytes_max: int = PART_BYTES_MAX,
        complain: Callable[[str], None] | None = None,
    ) -> None:
        self._dir = run_dir
        self._config = config
        self._part_bytes_max = part_bytes_max
        self._complain = complain or _to_stderr
        self._last_ns: defaultdict[str, int] = defaultdict(int)
        self._scene: SceneData | None = None
        self._goal = Goal.of(tomllib.loads(config.text))
        self._flushed_ns = 0
        self._sequences: defaultdict[str, int] = defaultdict(int)
        self._reserve = run_dir / ".record-reserve"
        #: Why nothing is written any more, or ``""``.
        self.stopped = ""
        try:
            self._part = _new_part(run_dir)
            self._reserve.write_bytes(bytes(RESERVE_BYTES))
            self._begin()
        except OSError as error:
            raise RecordError(
                f"the record cannot be begun in {run_dir}: {error}; choose another folder"
            ) from error

    def write(
        self, message: messages.Message, *, log_ns: int, publish_ns: int | None = None
    ) -> None:
        """Write one message.

        Args:
            message: Of a recorded type; a trace with a tip also draws its path, and moves the
                bodies of the scene. A scene that is known already is not written again.
            log_ns: When it was received [ns since the epoch]; never runs backwards on record.
            publish_ns: When it was said, if known [ns since the epoch].

        Raises:
            RecordError: If the message's type is not recorded.
        """
        if type(message) not in TOPICS:
            raise RecordError(f"messages of type {type(message).__name__} are not recorded")
        if isinstance(message, SceneData):
            if message != self._scene:
                self._scene = message
                self._put_scene(message, log_ns)
            return
        self._put(TOPICS[type(message)], schemas.encode(message), log_ns, publish_ns)
        if isinstance(message, TraceData):
            self._put_motion(message, log_ns)

    def log(self, level: foxglove.Level, text: str, *, log_ns: int) -> None:
        """Write one line to the record's own log."""
        self._put_standard(LOG_TOPIC, foxglove.log_line(level, text, log_ns), log_ns)

    def tick(self, now_ns: int) -> None:
        """Close the chunk if it is old, and the part if it is large; call a few times a second."""
        if now_ns - self._flushed_ns >= CHUNK_AGE_NS:
            self._guarded(self._part.flush)
            self._flushed_ns = now_ns
        if not self.stopped and self._part.bytes_written > self._part_bytes_max:
            self._guarded(self._rotate)

    def close(self) -> None:
        """End the record properly; may be called again."""
        self._guarded(self._part.finish)
        self._part.close()
        self._reserve.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _put_scene(self, scene: SceneData, log_ns: int) -> None:
        self._put(TOPICS[SceneData], schemas.encode(scene), log_ns, log_ns)
        self._put_standard(SCENE_TOPIC, scene_update(scene, self._goal, log_ns), log_ns)
        self._put(FIXED_TOPIC, fixed_transforms(scene, log_ns), log_ns, log_ns)

    def _put_motion(self, trace: TraceData, log_ns: int) -> None:
        """Write a trace's path and motion in types that other tools can draw."""
        frame = self._scene.tip_in if self._scene else ""
        if poses := foxglove.tip_poses(trace):
            head = {"timestamp": foxglove.timestamp(log_ns), "frame_id": frame or ROOT}
            path = schemas.encode_standard(TIP_TOPIC.schema, head) + poses
            self._put(TIP_TOPIC, path, log_ns, log_ns)
        if self._scene is not None:
            for at_ns, data in motion(self._scene, trace, self._last_ns[TF_TOPIC.name], log_ns):
                self._put(TF_TOPIC, data, at_ns, at_ns)

    def _put_standard(self, topic: Topic, values: Mapping[str, Any], log_ns: int) -> None:
        self._put(topic, schemas.encode_standard(topic.schema, values), log_ns, log_ns)

    def _put(self, topic: Topic, data: bytes, log_ns: int, publish_ns: int | None) -> None:
        at_ns = self._last_ns[topic.name] = max(self._last_ns[topic.name], log_ns)
        published = at_ns if publish_ns is None else publish_ns
        sequence = self._sequences[topic.name]
        self._sequences[topic.name] = (sequence + 1) % 2**32
        self._guarded(lambda: self._part.add(topic, data, at_ns, max(published, 0), sequence))

    def _begin(self) -> None:
        now_ns = int(self._config.at_s * 1e9)
        head = schemas.encode(self._config)
        self._part.add(TOPICS[RunConfig], head, now_ns, now_ns, 0)
        if self._scene is not None:
            self._put_scene(self._scene, max(now_ns, *self._last_ns.values()))
        self._part.flush()

    def _rotate(self) -> None:
        self._part.finish()
        self._part.close()
        self._part = _new_part(self._dir)
        self._begin()

    def _guarded(self, act: Callable[[], None]) -> None:
        if self.stopped:
            return
        try:
            act()
        except OSError as error:
            self._stop(error)

    def _stop(self, error: OSError) -> None:
        self.stopped = (
            f"recording stopped: {error.strerror or error} in {self._dir}; the run goes on"
            " unrecorded, its journal keeps every outcome: free some space, then start it again"
        )
        with contextlib.suppress(OSError):
            self._reserve.unlink(missing_ok=True)
        at_ns = max(self._last_ns.values(), default=0)
        line = foxglove.log_line(foxglove.Level.ERROR, self.stopped, at_ns)
        self._part.abandon(schemas.encode_standard(LOG_TOPIC.schema, line), at_ns)
        self._complain(self.stopped)


class _Part:
    """One open MCAP file with all channels declared, locked while it is written."""

    def __init__(self, path: Path, sink: _Sink) -> None:
        self._path = path
        self._sink = sink
        self._whole_bytes = 0
        self._finished = False
        self._writer = Writer(self._sink, chunk_size=CHUNK_BYTES, compression=COMPRESSION)
        self._writer.start(profile="shearline")
        self._channels = {
            topic.name: _declare(self._writer, topic) for topic in (*TOPICS.values(), *STANDARD)
        }

    @property
    def bytes_written(self) -> int:
        return self._sink.tell()

    def add(self, topic: Topic, data: bytes, log_ns: int, publish_ns: int, sequence: int) -> None:
        self._writer.add_message(
            channel_id=self._channels[topic.name],
            log_time=log_ns,
            data=data,
            publish_time=publish_ns,
            sequence=sequence,
        )

    def flush(self) -> None:
        self._writer.flush()
        self._whole_bytes = self._sink.tell()

    def finish(self) -> None:
        if not self._finished:
            self.flush()
            self._writer.finish()
            self._finished = True

    def close(self) -> None:
        self._sink.close()

    def abandon(self, last_line: bytes, log_ns: int) -> None:
        """Cut what was half written, say why, and end the file; on a full disk as far as it goes.

        What cannot be written now is written when the part is sealed at the next start.
        """
        self._finished = True
        with contextlib.suppress(OSError):
            self._sink.truncate(self._whole_bytes)
            self._sink.write(_single(self._channels[LOG_TOPIC.name], last_line, log_ns))
            self._whole_bytes = self._sink.tell()
        with contextlib.suppress(OSError):
            self._sink.truncate(self._whole_bytes)
        self._sink.close()
        with contextlib.suppress(OSError):
            seal(self._path)


class _Sink:
    """The file underneath: unbuffered, so that no bytes linger where a kill would lose them."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_CLOEXEC)
        fcntl.flock(self._file, fcntl.LOCK_EX)  # waits for a reader's glance, no longer
        self._offset = 0
        self._open = True

    def is_linked(self) -> bool:
        """Tell whether the file still has its name: sealing removes parts that hold nothing."""
        return os.fstat(self._file).st_nlink > 0

    def write(self, data: bytes) -> int:
        rest = memoryview(data)
        while rest:
            written = os.write(self._file, rest)
            self._offset += written
            rest = rest[written:]
        return len(data)

    def tell(self) -> int:
        return self._offset

    def flush(self) -> None:
        """Do nothing: every write has already reached the system."""

    def truncate(self, size: int) -> None:
        os.ftruncate(self._file, size)
        self._offset = os.lseek(self._file, size, os.SEEK_SET)

    def close(self) -> None:
        if self._open:
            self._open = False
            os.close(self._file)


def _new_part(run_dir: Path) -> _Part:
    while True:
        path = create_next(run_dir)
        sink = _Sink(path)
        if sink.is_linked():
            return _Part(path, sink)
        sink.close()


def _declare(writer: Writer, topic: Topic) -> int:
    schema = writer.register_schema(topic.schema, "protobuf", schemas.file_set(topic.schema))
    return int(
        writer.register_channel(topic.name, "protobuf", schema, metadata={"about": topic.about})
    )


def _single(channel: int, data: bytes, log_ns: int) -> bytes:
    """Return one chunk that holds one message, and its index."""
    inner = RecordBuilder()
    Message(channel_id=channel, log_time=log_ns, data=data, publish_time=log_ns, sequence=0).write(
        inner
    )
    body = inner.end()
    outer = RecordBuilder()
    Chunk(
        compression="",
        data=body,
        message_end_time=log_ns,
        message_start_time=log_ns,
        uncompressed_crc=zlib.crc32(body),
        uncompressed_size=len(body),
    ).write(outer)
    MessageIndex(channel_id=channel, records=[(log_ns, 0)]).write(outer)
    return bytes(outer.end())


def _to_stderr(sentence: str) -> None:
    print(sentence, file=sys.stderr, flush=True)  # noqa: T201 - the recorder's last words
