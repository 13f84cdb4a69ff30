"""The moving scene as ``foxglove.FrameTransforms``, many moments of a trial at once.

All messages of one trial have the same layout, so they are laid out once and the numbers of all
moments are filled in as columns of bytes: a hundred times cheaper than message by message. Every
number is written in its full width, which protobuf admits.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from shearline.protocol.messages import TraceData
from shearline.protocol.pose import Placed
from shearline.protocol.scene import SceneData
from shearline.record.bodies import Motion, moving, standing

#: Moments kept of a trial's second [1/s]: an eye sees no more.
TF_HZ = 50.0
#: More of one trial than this are spread wider, however long it was.
MOMENTS_MAX = 2000
#: Moments in one message: a message costs the recorder as much as ten moments in it.
MOMENTS_EACH = 10
ROOT = "world"
#: Of a metre, and of a quaternion's unit: a power of two, so that numbers end in zeros.
GRAINS = 2.0**20

#: Protobuf: (field << 3) | wire type; 0 varint, 1 fixed 64 bits, 2 with a length.
_TRANSFORMS, _TIMESTAMP, _PARENT, _CHILD = b"\x0a", b"\x0a", b"\x12", b"\x1a"
_TRANSLATION, _ROTATION = b"\x22", b"\x2a"
_SECONDS, _NANOS = b"\x08", b"\x10"
#: A varint of five groups of seven bits holds any second until the year 3058, and any nanosecond.
_VARINT = 5


def motion(
    scene: SceneData, trace: TraceData, after_ns: int, until_ns: int
) -> Iterator[tuple[int, bytes]]:
    """Yield when and where the bodies were in one trial: ``(ns since the epoch, message)``.

    Every transform says its own moment; several moments share a message.

    A simulator's trials are faster than their own clocks, and several evaluators' trials run at
    once: each is given the time since the one before it ended, so that played back at the speed of
    the record they pass one after another. A trial that took longer than its clock keeps its clock.

    Args:
        scene: What there is.
        trace: The trial's.
        after_ns: End of the trial before.
        until_ns: When the trace came.
    """
    values = np.frombuffer(trace.data, dtype="<f4").reshape(len(trace.names), trace.samples)
    moves = {body.column for body in scene.bodies}
    wanted = [i for i, name in enumerate(trace.names) if name in moves]
    if trace.samples < 1 or not wanted:
        return
    span_s = float(values[0, -1] - values[0, 0])
    count = min(max(2, int(span_s * TF_HZ) + 1), MOMENTS_MAX, trace.samples)
    kept = np.linspace(0, trace.samples - 1, count).astype(int)
    shares = (values[0, kept].astype(np.float64) - values[0, 0]) / max(span_s, 1e-9)
    given_ns = max(0, min(int(span_s * 1e9), until_ns - after_ns - 1))
    at_ns = until_ns - given_ns + (np.clip(shares, 0.0, 1.0) * given_ns).astype(np.int64)
    columns = {trace.names[i]: values[i, kept] for i in wanted}
    table = frame_transforms(scene, columns, trace.placed, at_ns)
    for start in range(0, len(at_ns), MOMENTS_EACH):
        part = slice(start, start + MOMENTS_EACH)
        yield int(at_ns[start]), table[part].tobytes()


def frame_transforms(
    scene: SceneData,
    columns: dict[str, npt.NDArray[np.float32]],
    placed: Sequence[Placed],
    at_ns: npt.NDArray[np.int64],
) -> npt.NDArray[np.uint8]:
    """Return one ``foxglove.FrameTransforms`` for each moment, of every body that is not fixed.

    Args:
        scene: What there is.
        columns: Column name to values at those moments ``(n,)``.
        placed: Bodies whose place is this trial's own.
        at_ns: The moments ``(n,)`` [ns since the epoch].

    Returns:
        ``(n, bytes)``; messages of this type may be joined to one.
    """
    parents = {body.name: body.parent or ROOT for body in scene.bodies}
    numbers = {place.body: _still(place, len(at_ns)) for place in placed if place.body in parents}
    numbers |= {motion.body.name: _numbers(motion) for motion in moving(scene, columns)}
    return _filled(tuple((parents[name], name) for name in numbers), list(numbers.values()), at_ns)


def fixed_transforms(scene: SceneData, at_ns: int) -> bytes:
    """Return one ``foxglove.FrameTransforms`` of every body where the scene has it."""
    bodies = [body for body in scene.bodies if body.name != ROOT]
    places = {place.body: _still(place, 1) for place in standing(scene, [])}
    names = tuple((body.parent or ROOT, body.name) for body in bodies)
    return _filled(names, [places[body.name] for body in bodies], np.array([at_ns])).tobytes()


def _numbers(motion: Motion) -> npt.NDArray[np.float64]:
    numbers = np.concatenate([motion.position, motion.quaternion], axis=1).astype(np.float64)
    # digits below a micrometre are noise that does not compress
    return np.round(numbers * GRAINS) / GRAINS


def _still(place: Placed, n: int) -> npt.NDArray[np.float64]:
    return np.tile(np.array([*place.position, *place.quaternion]), (n, 1))


def _filled(
    names: tuple[tuple[str, str], ...],
    numbers: list[npt.NDArray[np.float64]],
    at_ns: npt.NDArray[np.int64],
) -> npt.NDArray[np.uint8]:
    """Return the layout of all bodies, once for each moment, with its numbers in it."""
    n = len(at_ns)
    if not names:
        return np.zeros((n, 0), dtype=np.uint8)
    layout, seconds, nanos, record = _layouts(names)
    table = np.tile(layout, (n, 1))
    said = _varints(at_ns // 10**9), _varints(at_ns % 10**9)
    for offsets, varints in zip((seconds, nanos), said, strict=True):
        for offset in offsets:
            table[:, offset : offset + _VARINT] = varints
    # seen as records with a number at each place, whole numbers are written and not their bytes
    rows = table.view(record)[:, 0]
    for name, column in zip(record.names or (), np.concatenate(numbers, axis=1).T, strict=True):
        rows[name] = column
    return table


@functools.lru_cache(maxsize=64)
def _layouts(
    names: tuple[tuple[str, str], ...],
) -> tuple[npt.NDArray[np.uint8], list[int], list[int], np.dtype[np.void]]:
    """Return the bytes of all bodies' transforms, blank, and where seconds and so on stand."""
    whole = b""
    seconds: list[int] = []
    nanos: list[int] = []
    doubles: list[int] = []
    for parent, child in names:
        layout, second, nano, numbers = _layout(parent, child)
        seconds.append(len(whole) + second)
        nanos.append(len(whole) + nano)
        doubles += [len(whole) + offset for offset in numbers]
        whole += layout
    record = np.dtype(
        {
            "names": [f"f{i}" for i in range(len(doubles))],
            "formats": ["<f8"] * len(doubles),
            "offsets": doubles,
            "itemsize": len(whole),
        }
    )
    return np.frombuffer(whole, dtype=np.uint8), seconds, nanos, record


def _layout(parent: str, child: str) -> tuple[bytes, int, int, tuple[int, ...]]:
    """Return the bytes of one transform with its numbers left blank, and where they stand."""
    time = _SECONDS + bytes(_VARINT) + _NANOS + bytes(_VARINT)
    names = _sized(_PARENT, parent.encode()) + _sized(_CHILD, child.encode())
    head = _sized(_TIMESTAMP, time) + names
    translation, rotation = _sized(_TRANSLATION, _doubles(3)), _sized(_ROTATION, _doubles(4))
    body = head + translation + rotation
    whole = _sized(_TRANSFORMS, body)
    start = len(whole) - len(body)
    # behind tag and length of the timestamp, and the tag of its seconds
    seconds = start + 3
    first = start + len(head) + 3
    second = first + len(translation)
    doubles = (*(first + 9 * i for i in range(3)), *(second + 9 * i for i in range(4)))
    return whole, seconds, seconds + _VARINT + 1, doubles


def _doubles(n: int) -> bytes:
    return b"".join(bytes([(field << 3) | 1]) + bytes(8) for field in range(1, n + 1))


def _sized(tag: bytes, body: bytes) -> bytes:
    """Return a field with its length, as a varint that is not padded."""
    length, sizes = len(body), []
    while length > 0x7F:
        sizes.append((length & 0x7F) | 0x80)
        length >>= 7
    return tag + bytes([*sizes, length]) + body


def _varints(values: npt.NDArray[np.int64]) -> npt.NDArray[np.uint8]:
    """Return varints ``(n, 5)`` padded to five bytes."""
    groups = (values[:, None] >> (7 * np.arange(_VARINT))) & 0x7F
    groups[:, :-1] |= 0x80
    return groups.astype(np.uint8)
