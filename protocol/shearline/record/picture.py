"""Draws a run into a Rerun stream, message by message, from a file or live alike.

Two timelines: ``trial`` counts trials, so that the cursor on trial 37 shows everything of trial
37 (its card, its curves, its path in space) and every plot is over trials; ``played`` lays the
trials end to end on their own clocks, to play them one after another. Nothing here reads files,
starts a viewer, or knows which task it draws.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import rerun as rr

from shearline.protocol.messages import Counted, EpisodeClosed, EvaluatorState, OutcomeKind
from shearline.record import charts, columns
from shearline.record.card import card
from shearline.record.reader import Trace
from shearline.record.topics import RunConfig

#: How many charts of one trial there are room for.
CHARTS = 4
#: How many groups of signals are played; the record has all of them.
PLAYED = 6
#: Samples of one trial kept for playing: enough to scroll through, 2000 trials stay light.
PLAYED_SAMPLES = 120
#: Arrows of force drawn along one path, and their scale [m/N].
ARROWS = 24
METRES_PER_NEWTON = 0.0005
#: The lock is drawn as a block around its keyway, half as wide and high as this says [m].
LOCK_HALF_M = (0.006, 0.010)
#: Pause between trials on the ``played`` timeline [s].
PAUSE_S = 0.5

GREEN = (70, 200, 120)
RED = (235, 90, 80)
GREY = (130, 130, 140)
YELLOW = (200, 170, 70)
WHITE = (235, 235, 240)
COLOURS = {
    OutcomeKind.SUCCESS: GREEN,
    OutcomeKind.FAILURE: RED,
    None: GREY,
}
THIN = rr.Radius.ui_points(1.3)
FAINT = rr.Radius.ui_points(0.5)
#: Distinct on dark and light ground, also without red and green side by side first.
SERIES = (
    (86, 156, 240),
    (240, 160, 60),
    (120, 210, 190),
    (220, 120, 200),
    (200, 200, 90),
    (160, 130, 240),
    (240, 120, 100),
)


@dataclass(frozen=True, slots=True)
class Lock:
    """Where the tip is to go, in the frame of the lock.

    Attributes:
        depth_m: Depth that counts as inserted [m].
        roi_m: Radius of the region of interest around it [m].
    """

    depth_m: float
    roi_m: float

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Lock | None:
        """Return what a run's settings say of the lock, or ``None`` if they say nothing."""
        task = settings.get("task", {})
        options = task.get("options", {}) if isinstance(task, Mapping) else {}
        depth_m, roi_m = options.get("depth_m"), options.get("roi_m")
        if not isinstance(depth_m, float) or not isinstance(roi_m, float):
            return None
        return cls(depth_m, roi_m)


class Picture:
    """A run as it is drawn.

    Args:
        stream: Where to draw; owned by the caller.
        config: What was asked for, if known: names and units of parameters, limits.
    """

    def __init__(self, stream: rr.RecordingStream, config: RunConfig | None) -> None:
        self._rec = stream
        settings = tomllib.loads(config.text) if config else {}
        self._limits = columns.limits_of(settings)
        self._lock = Lock.of(settings)
        self._config = config
        self._best = np.inf
        self._played_s = 0.0
        self._outcomes: dict[int, Counted] = {}
        self._extremes: dict[str, tuple[float, float]] = {}
        self._styled: set[str] = set()
        self._last_trial = 0
        self._styles()

    def outcome(self, counted: Counted) -> None:
        """Draw the outcome of one trial: its points in the plots and its card."""
        self._outcomes[counted.trial] = counted
        self._last_trial = max(self._last_trial, counted.trial)
        self._rec.set_time("trial", sequence=counted.trial)
        self._rec.set_time("clock", timestamp=counted.at_s)
        self._rec.log(
            "card", rr.TextDocument(card(counted, self._config), media_type="text/markdown")
        )
        if counted.kind is None:
            return
        kind = counted.kind.value
        self._rec.log(f"cost/{kind}", rr.Scalars([counted.cost]))
        if counted.kind is OutcomeKind.SUCCESS and counted.cost < self._best:
            self._best = counted.cost
        if np.isfinite(self._best):
            self._rec.log("cost/best", rr.Scalars([self._best]))
        for name, value in zip(self._names(counted), counted.theta, strict=False):
            self._rec.log(f"parameters/{name}/{kind}", rr.Scalars([value]))

    def episode(self, closed: EpisodeClosed, last_trial: int | None = None) -> None:
        """Draw what an episode came to, at its last trial, with one standard error."""
        at = self._last_trial if last_trial is None else last_trial
        self._rec.set_time("trial", sequence=at)
        self._rec.set_time("clock", timestamp=closed.at_s)
        # Agresti and Coull (1998): two more of each keep the error honest at 0 and 1
        n = closed.trials + 4
        p = (closed.successes + 2) / n
        self._rec.log(
            "success_rate",
            rr.Measurements(
                values=[100.0 * closed.success_rate],
                variances=[1e4 * p * (1.0 - p) / n],
                units="%",
                names="success",
                colors=[GREEN],
                widths=[2.0],
            ),
        )
        if closed.mean_cost is not None:
            self._rec.log("cost/episode_mean", rr.Scalars([closed.mean_cost]))

    def evaluator(self, state: EvaluatorState) -> None:
        """Draw where an evaluator stands, on the wall clock."""
        self._rec.reset_time()
        self._rec.set_time("clock", timestamp=state.at_s)
        self._rec.log(f"evaluators/{state.evaluator}", rr.StateChange(state=state.state))
        self._rec.reset_time()

    def trace(self, trace: Trace) -> None:
        """Draw one trial's curves, path and force."""
        if not trace.t_s.size:
            return
        start_s = self._played_s
        self._played_s += float(trace.t_s[-1]) + PAUSE_S
        self._last_trial = max(self._last_trial, trace.trial)
        self._rec.reset_time()
        self._rec.set_time("trial", sequence=trace.trial)
        self._rec.set_time("played", duration=start_s)
        groups = columns.groups(trace, self._limits)
        for slot, group in enumerate(groups[:CHARTS]):
            self._chart(slot, group, trace)
        self._path(trace)
        self._rec.reset_time()
        self._play(trace, groups, start_s)

    def _chart(self, slot: int, group: columns.Group, trace: Trace) -> None:
        low, high = charts.bounds(*self._seen(group))
        drawn = charts.chart(trace.t_s, group.values, low, high, events=trace.events)
        path = f"charts/{slot}"
        self._frame(path, group, drawn)
        colours = [SERIES[i % len(SERIES)] for i in range(len(drawn.lines))]
        lines = rr.LineStrips2D(drawn.lines, colors=colours, radii=THIN, draw_order=2)
        self._rec.log(f"{path}/lines", lines)
        self._rec.log(f"{path}/ticks", _labels(drawn.marks, drawn.labels, GREY))
        events = rr.LineStrips2D(drawn.events, colors=YELLOW, radii=FAINT)
        self._rec.log(f"{path}/events", events)
        if slot == 0:
            self._event_names(path, drawn, trace)

    def _frame(self, path: str, group: columns.Group, drawn: charts.Chart) -> None:
        """Draw once what is the same for every trial: grid, title, names of the curves."""
        if path in self._styled:
            return
        self._styled.add(path)
        grid = rr.LineStrips2D(drawn.grid, colors=(90, 90, 98), radii=FAINT)
        self._rec.log(f"{path}/grid", grid, static=True)
        title = _labels(np.array([[charts.WIDTH / 2, -14.0]]), [_title(group)], WHITE)
        self._rec.log(f"{path}/title", title, static=True)
        if len(group.names) > 1:
            ends = np.array([[charts.WIDTH + 14.0, 12.0 * i] for i in range(len(group.names))])
            short = [name.split(".", 1)[-1] for name in group.names]
            colours = [SERIES[i % len(SERIES)] for i in range(len(short))]
            self._rec.log(f"{path}/legend", _labels(ends, short, colours), static=True)

    def _event_names(self, path: str, drawn: charts.Chart, trace: Trace) -> None:
        """Name the upright lines, one below the other so that close ones stay readable."""
        marks = [(line[0, 0], 6.0 + 9.0 * i) for i, line in enumerate(drawn.events)]
        if marks:
            names = [name for _, name in trace.events]
            self._rec.log(f"{path}/event_names", _labels(np.array(marks), names, YELLOW))

    def _seen(self, group: columns.Group) -> tuple[float, float]:
        """Return a group's extremes over all trials so far: on one scale they can be compared."""
        finite = [values[np.isfinite(values)] for values in group.values]
        low = min((float(values.min()) for values in finite if values.size), default=0.0)
        high = max((float(values.max()) for values in finite if values.size), default=0.0)
        was_low, was_high = self._extremes.get(group.name, (low, high))
        self._extremes[group.name] = (min(low, was_low), max(high, was_high))
        return self._extremes[group.name]

    def _path(self, trace: Trace) -> None:
        """Draw the whole path of the tip and the force along it, for the trial's number."""
        tip = columns.tip(trace)
        if tip is None:
            return
        colour = COLOURS[self._kind(trace)]
        thin = tip[charts.telling(list(tip.T), charts.POINTS_MAX)]
        radius = rr.Radius.ui_points(1.6)
        self._rec.log("scene/path", rr.LineStrips3D([thin], colors=[colour], radii=radius))
        self._rec.log("scene/end", rr.Points3D([tip[-1]], colors=[colour], radii=0.0008))
        force = columns.force(trace)
        if columns.in_lock(trace):
            self._draw_lock()
        if force is not None:
            at = np.linspace(0, len(tip) - 1, ARROWS).astype(int)
            self._rec.log("scene/forces", _arrows(tip[at], force[at], radius_m=0.00012))

    def _draw_lock(self) -> None:
        """Draw the lock around its own axis: mouth plane at z = 0, z into the lock."""
        if self._lock is None or "lock" in self._styled:
            return
        self._styled.add("lock")
        body = rr.Boxes3D(
            centers=[(0.0, 0.0, self._lock.depth_m / 2.0)],
            half_sizes=[(*LOCK_HALF_M, self._lock.depth_m / 2.0)],
            colors=[(150, 150, 165)],
            radii=0.0001,
        )
        self._rec.log("scene/lock", body, static=True)
        goal = rr.Ellipsoids3D(
            centers=[(0.0, 0.0, self._lock.depth_m)],
            half_sizes=[(self._lock.roi_m,) * 3],
            colors=[(86, 156, 240)],
            line_radii=0.00003,
        )
        self._rec.log("scene/region_of_interest", goal, static=True)

    def _play(self, trace: Trace, groups: list[columns.Group], start_s: float) -> None:
        """Lay the trial on the ``played`` timeline: signals, moving tip, phases."""
        for group in groups[:PLAYED]:
            kept = charts.telling(group.values, PLAYED_SAMPLES)
            values = np.stack([column[kept] for column in group.values], axis=1)
            lengths = [values.shape[1]] * len(values)
            scalars = rr.Scalars.columns(scalars=values.ravel().astype(np.float64))
            self._style(group)
            self._columns(f"signals/{group.name}", trace, kept, start_s, scalars.partition(lengths))
        tip = columns.tip(trace)
        if tip is not None:
            kept = charts.telling(list(tip.T), PLAYED_SAMPLES)
            points = rr.Points3D.columns(positions=tip[kept])
            self._columns("scene/tip", trace, kept, start_s, points)
        for at_s, name in trace.events:
            self._rec.set_time("played", duration=start_s + at_s)
            self._rec.log("phase", rr.StateChange(state=name))
        self._rec.set_time("played", duration=self._played_s - PAUSE_S / 2)
        self._rec.log("phase", rr.Clear(recursive=False))
        self._rec.reset_time()

    def _columns(
        self,
        path: str,
        trace: Trace,
        kept: npt.NDArray[np.intp],
        start_s: float,
        values: rr.ComponentColumnList,
    ) -> None:
        t_s = start_s + trace.t_s[kept].astype(np.float64)
        rr.send_columns(path, [rr.TimeColumn("played", duration=t_s)], values, recording=self._rec)

    def _style(self, group: columns.Group) -> None:
        if group.name in self._styled:
            return
        self._styled.add(group.name)
        style = rr.SeriesLines(
            names=[f"{name} [{group.unit}]" for name in group.names],
            colors=[SERIES[i % len(SERIES)] for i in range(len(group.names))],
        )
        self._rec.log(f"signals/{group.name}", style, static=True)

    def _styles(self) -> None:
        for kind, colour in (("success", GREEN), ("failure", RED)):
            style = rr.SeriesPoints(colors=[colour], names=[kind], marker_sizes=[3.0])
            self._rec.log(f"cost/{kind}", style, static=True)
            for name in self._config.names if self._config else ():
                self._rec.log(f"parameters/{name}/{kind}", style, static=True)
        best = rr.SeriesLines(colors=[(86, 156, 240)], names=["best so far"], widths=[1.5])
        self._rec.log("cost/best", best, static=True)
        mean = rr.SeriesLines(colors=[(240, 200, 90)], names=["episode mean"], widths=[2.0])
        self._rec.log("cost/episode_mean", mean, static=True)
        self._rec.log(
            "scene/tip",
            rr.Points3D.from_fields(colors=[(255, 230, 120)], radii=[0.001]),
            static=True,
        )

    def _names(self, counted: Counted) -> Sequence[str]:
        if self._config and self._config.names:
            return self._config.names
        return [f"x{i}" for i in range(len(counted.theta))]

    def _kind(self, trace: Trace) -> OutcomeKind | None:
        known = self._outcomes.get(trace.trial)
        if known is not None:
            return known.kind if known.kind in COLOURS else None
        won = any(name == "success" for _, name in trace.events)
        return OutcomeKind.SUCCESS if won else OutcomeKind.FAILURE


def _title(group: columns.Group) -> str:
    name = "push and wiggle" if group.name == "push_wiggle" else group.name
    return f"{name} [{group.unit}]" if group.unit else name


def _labels(
    marks: npt.NDArray[np.float64],
    labels: list[str],
    colours: tuple[int, int, int] | list[tuple[int, int, int]],
) -> rr.Points2D:
    radius = rr.Radius.ui_points(0.1)
    return rr.Points2D(marks, labels=labels, colors=colours, radii=radius, show_labels=True)


def _arrows(
    origins: npt.NDArray[np.float32], forces: npt.NDArray[np.float32], *, radius_m: float
) -> rr.Arrows3D:
    return rr.Arrows3D(
        origins=origins,
        vectors=forces * METRES_PER_NEWTON,
        colors=[(240, 160, 60)],
        radii=radius_m,
    )
