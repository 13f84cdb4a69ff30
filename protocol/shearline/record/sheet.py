"""Rows for a Rerun stream, gathered by entity and sent in columns.

One call of the viewer's library costs the same for one row as for ten thousand; a run of two
thousand trials has a hundred thousand rows. Whoever draws says what stands where and when; what is
drawn is not known here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt
import rerun as rr

#: Values of one component: an array, instances first, or a list of texts.
Values: TypeAlias = npt.NDArray[Any] | Sequence[str]
#: Timeline to when: an array of one value per row.
Times: TypeAlias = Mapping[str, npt.NDArray[Any]]

#: Timelines that count trials; all others are lengths of time, except the wall clock.
COUNTED = frozenset({"trial", "rank"})
CLOCK = "clock"


class Archetype(Protocol):
    """What the viewer can draw, as a class: points, lines, texts."""

    @classmethod
    def columns(cls, **components: Any) -> rr.ComponentColumnList:
        """Return one column per component."""
        ...


@dataclass(slots=True)
class _Rows:
    """Rows of one entity that have the same kind, timelines and components."""

    times: dict[str, list[npt.NDArray[Any]]] = field(default_factory=dict)
    values: dict[str, list[Values]] = field(default_factory=dict)
    lengths: dict[str, list[npt.NDArray[np.int64]]] = field(default_factory=dict)


class Sheet:
    """Rows that wait to be sent.

    Args:
        stream: Where to; owned by the caller.
    """

    def __init__(self, stream: rr.RecordingStream) -> None:
        self.stream = stream
        self._rows: dict[tuple[str, type[Archetype], tuple[str, ...]], _Rows] = {}

    def static(self, path: str, *things: rr.AsComponents) -> None:
        """Say what holds at all times."""
        self.stream.log(path, *things, static=True)

    def row(
        self, path: str, at: Mapping[str, float], kind: type[Archetype], **components: Values
    ) -> None:
        """Add one row.

        Args:
            path: Entity.
            at: Timeline to when; trials, seconds, or seconds since the epoch for ``clock``.
            kind: Archetype that the components belong to.
            components: All instances of each.
        """
        times = {timeline: np.array([value]) for timeline, value in at.items()}
        lengths = {name: np.array([len(values)]) for name, values in components.items()}
        self._add(path, times, kind, components, lengths)

    def rows(
        self,
        path: str,
        times: Times,
        kind: type[Archetype],
        *,
        each: int = 1,
        **components: Values,
    ) -> None:
        """Add many rows at once, ``each`` instances in every one of them."""
        n_rows = len(next(iter(times.values())))
        lengths = {name: np.full(n_rows, each) for name in components}
        self._add(path, times, kind, components, lengths)

    def flush(self) -> None:
        """Send everything that waits."""
        waiting, self._rows = self._rows, {}
        for (path, kind, _), rows in waiting.items():
            indexes = [_time_column(name, parts) for name, parts in rows.times.items()]
            rr.send_columns(path, indexes, list(_columns(kind, rows)), recording=self.stream)

    def _add(
        self,
        path: str,
        times: Times,
        kind: type[Archetype],
        components: Mapping[str, Values],
        lengths: Mapping[str, npt.NDArray[np.int64]],
    ) -> None:
        rows = self._rows.setdefault((path, kind, (*times, *components)), _Rows())
        for timeline, values in times.items():
            rows.times.setdefault(timeline, []).append(values)
        for name, found in components.items():
            rows.values.setdefault(name, []).append(found)
            rows.lengths.setdefault(name, []).append(lengths[name])


def _columns(kind: type[Archetype], rows: _Rows) -> Iterable[Any]:
    for name, parts in rows.values.items():
        lengths = np.concatenate(rows.lengths[name])
        yield from kind.columns(**{name: _joined(parts)}).partition(lengths)


def _joined(parts: list[Values]) -> Any:
    arrays = [part for part in parts if isinstance(part, np.ndarray)]
    if len(arrays) == len(parts):
        return np.concatenate(arrays)
    return [text for part in parts for text in part]


def _time_column(timeline: str, parts: list[npt.NDArray[Any]]) -> rr.TimeColumn:
    values = np.concatenate(parts)
    if timeline in COUNTED:
        return rr.TimeColumn(timeline, sequence=values.astype(np.int64))
    if timeline == CLOCK:
        return rr.TimeColumn(timeline, timestamp=values.astype(np.float64))
    return rr.TimeColumn(timeline, duration=values.astype(np.float64))
