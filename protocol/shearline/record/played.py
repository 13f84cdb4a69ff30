"""Trials laid end to end on the timeline ``played``: signals, the moving scene, phases.

What is given is taken as it is; how finely a trial is shown is decided before. Poses are worked
out for many trials at once, when all is handed over.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import rerun as rr

from shearline.record import columns
from shearline.record.columns import Group
from shearline.record.palette import series
from shearline.record.reader import Trace
from shearline.record.sheet import Sheet, Times
from shearline.record.space import Space

#: How many groups of signals are played; the record has all of them.
PLAYED = 6
#: Pause between trials [s].
PAUSE_S = 0.5
#: Of the points of a curve, every so many-th is played: plots of a whole run are wide.
EVERY = 3


@dataclass(slots=True)
class _Waiting:
    """Columns of trials whose bodies are still to be moved."""

    samples: list[npt.NDArray[np.float32]] = field(default_factory=list)
    clocks: list[npt.NDArray[np.float64]] = field(default_factory=list)
    times: list[Times] = field(default_factory=list)


class Played:
    """The ``played`` timeline.

    Args:
        sheet: Where rows go.
        space: What moves.
        points: Samples of a thinned trace.
    """

    def __init__(self, sheet: Sheet, space: Space, points: int) -> None:
        self._sheet = sheet
        self._space = space
        self._kept = np.append(np.arange(0, points - 1, EVERY), points - 1)
        self._start_s = 0.0
        self._styled: set[str] = set()
        self._waiting: dict[tuple[tuple[str, ...], tuple[str, ...]], _Waiting] = {}

    def play(self, trace: Trace, groups: list[Group], times: Times) -> None:
        """Append one thinned trial; ``times`` say where its end stands on other timelines."""
        clock = self._start_s + trace.t_s.astype(np.float64)
        kept = self._kept
        at = {"played": clock[kept]}
        for group in groups[:PLAYED]:
            self._style(group)
            values = np.stack([column[kept] for column in group.values], axis=1)
            path, flat = f"signals/{group.name}", values.ravel().astype(np.float64)
            self._sheet.rows(path, at, rr.Scalars, each=values.shape[1], scalars=flat)
        tip = columns.tip(trace)
        if tip is not None:
            self._space.tip(tip[kept], at)
        self._phases(trace)
        self._bodies(trace, clock[kept], times)
        self._start_s += float(trace.t_s[-1]) + PAUSE_S

    def flush(self) -> None:
        """Work out where the bodies of all waiting trials are."""
        waiting, self._waiting = self._waiting, {}
        for (names, timelines), found in waiting.items():
            samples = np.concatenate(found.samples, axis=1)
            at = {"played": np.concatenate(found.clocks)}
            self._space.move(dict(zip(names, samples, strict=True)), at)
            ends = np.stack([samples[:, -1] for samples in found.samples], axis=1)
            when = {name: np.concatenate([at[name] for at in found.times]) for name in timelines}
            self._space.move(dict(zip(names, ends, strict=True)), when)

    def _bodies(self, trace: Trace, clock: npt.NDArray[np.float64], times: Times) -> None:
        names = tuple(name for name in self._space.columns() if name in trace.columns)
        if names:
            found = self._waiting.setdefault((names, tuple(times)), _Waiting())
            found.samples.append(np.stack([trace.columns[name][1][self._kept] for name in names]))
            found.clocks.append(clock)
            found.times.append(times)

    def _phases(self, trace: Trace) -> None:
        at_s = np.array([at_s for at_s, _ in trace.events]) + self._start_s
        names = [name for _, name in trace.events]
        if names:
            self._sheet.rows("phase", {"played": at_s}, rr.StateChange, state=names)
        end_s = self._start_s + float(trace.t_s[-1]) + PAUSE_S / 2
        self._sheet.row("phase", {"played": end_s}, rr.StateChange, state=[""])

    def _style(self, group: Group) -> None:
        if group.name in self._styled:
            return
        self._styled.add(group.name)
        style = rr.SeriesLines(
            names=[f"{name} [{group.unit}]" for name in group.names],
            colors=series(len(group.names)),
        )
        self._sheet.static(f"signals/{group.name}", style)
