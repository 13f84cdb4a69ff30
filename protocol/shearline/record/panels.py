"""The charts of the trial under the cursor: frame, curves, events and labels as entities.

Where points lie is worked out in :mod:`shearline.record.charts`; here they become rows of the
``charts`` entities, one chart for each of the groups that people tune by.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import rerun as rr

from shearline.record import charts
from shearline.record.columns import Group
from shearline.record.palette import GREY, WHITE, YELLOW, Colour, packed, series
from shearline.record.reader import Trace
from shearline.record.sheet import Sheet, Times

#: How many charts of one trial there are room for.
CHARTS = 4
THIN = rr.Radius.ui_points(1.3)
FAINT = rr.Radius.ui_points(0.5)
TINY = rr.Radius.ui_points(0.1)


class Panels:
    """The charts of one trial at a time.

    Args:
        sheet: Where rows go.
    """

    def __init__(self, sheet: Sheet) -> None:
        self._sheet = sheet
        self._extremes: dict[str, tuple[float, float]] = {}
        self._framed: set[str] = set()

    def draw(self, trace: Trace, groups: list[Group], times: Times) -> None:
        """Draw the first groups of a thinned trace."""
        for slot, group in enumerate(groups[:CHARTS]):
            low, high = charts.bounds(*self._seen(group))
            drawn = charts.chart(trace.t_s, group.values, low, high, events=trace.events)
            path = f"charts/{slot}"
            self._frame(path, group)
            self._curves(path, drawn, times)
            if slot == 0:
                self._event_names(path, drawn, trace, times)

    def _curves(self, path: str, drawn: charts.Chart, times: Times) -> None:
        sheet = self._sheet
        lines = drawn.lines.astype(np.float32)
        sheet.rows(f"{path}/lines", times, rr.LineStrips2D, each=len(lines), strips=lines)
        sheet.rows(f"{path}/ticks", times, rr.Points2D, each=len(drawn.labels), labels=drawn.labels)
        events = drawn.events.astype(np.float32)
        sheet.rows(f"{path}/events", times, rr.LineStrips2D, each=len(events), strips=events)

    def _frame(self, path: str, group: Group) -> None:
        """Draw once what is the same for every trial: grid, title, names of the curves."""
        if path in self._framed:
            return
        self._framed.add(path)
        static, colours = self._sheet.static, series(len(group.names))
        static(f"{path}/grid", rr.LineStrips2D(charts.grid(), colors=(90, 90, 98), radii=FAINT))
        static(
            f"{path}/lines",
            rr.LineStrips2D.from_fields(colors=colours, radii=[THIN], draw_order=2),
        )
        static(
            f"{path}/ticks",
            rr.Points2D.from_fields(
                positions=charts.marks(), colors=[GREY], radii=[TINY], show_labels=True
            ),
        )
        static(f"{path}/events", rr.LineStrips2D.from_fields(colors=[YELLOW], radii=[FAINT]))
        title = np.array([[charts.WIDTH / 2, -14.0]])
        static(f"{path}/title", labels(title, [_title(group)], [WHITE]))
        if len(group.names) > 1:
            ends = np.array([[charts.WIDTH + 14.0, 12.0 * i] for i in range(len(group.names))])
            short = [name.split(".", 1)[-1] for name in group.names]
            static(f"{path}/legend", labels(ends, short, colours))

    def _event_names(self, path: str, drawn: charts.Chart, trace: Trace, times: Times) -> None:
        """Name the upright lines, one below the other so that close ones stay readable."""
        marks = [(line[0, 0], 6.0 + 9.0 * i) for i, line in enumerate(drawn.events)]
        self._sheet.rows(
            f"{path}/event_names",
            times,
            rr.Points2D,
            each=len(marks),
            positions=np.array(marks, dtype=np.float32).reshape(-1, 2),
            labels=[name for _, name in trace.events],
            colors=np.full(len(marks), packed(YELLOW), dtype=np.uint32),
        )
        if f"{path}/event_names" not in self._framed:
            self._framed.add(f"{path}/event_names")
            style = rr.Points2D.from_fields(radii=[TINY], show_labels=True)
            self._sheet.static(f"{path}/event_names", style)

    def _seen(self, group: Group) -> tuple[float, float]:
        """Return a group's extremes over all trials so far: on one scale they can be compared."""
        values = np.stack(group.values)
        low, high = float(values.min()), float(values.max())
        if not math.isfinite(low + high):
            finite = values[np.isfinite(values)]
            low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
        was_low, was_high = self._extremes.get(group.name, (low, high))
        self._extremes[group.name] = (min(low, was_low), max(high, was_high))
        return self._extremes[group.name]


def labels(marks: npt.NDArray[np.float64], texts: list[str], colours: list[Colour]) -> rr.Points2D:
    """Return texts that stand at ``marks (n, 2)``."""
    return rr.Points2D(marks, labels=texts, colors=colours, radii=TINY, show_labels=True)


def _title(group: Group) -> str:
    name = "push and wiggle" if group.name == "push_wiggle" else group.name
    return f"{name} [{group.unit}]" if group.unit else name
