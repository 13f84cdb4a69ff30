"""Draws a run into a Rerun stream, message by message, from a file or live alike.

Two timelines: ``trial`` counts trials, so that the cursor on trial 37 shows everything of trial
37 (its card, its curves, its path in space) and every plot is over trials; ``played`` lays the
trials end to end on their own clocks, to play them one after another. Nothing here reads files,
starts a viewer, or knows which task it draws.
"""

from __future__ import annotations

from collections.abc import Sequence

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
#: Samples of one trial kept for playing: enough to scroll through, 2000 trials stay light.
PLAYED_SAMPLES = 120
#: Arrows of force drawn along one path, and their scale [m/N].
ARROWS = 24
METRES_PER_NEWTON = 0.0005
#: Pause between trials on the ``played`` timeline [s].
PAUSE_S = 0.5

GREEN = (70, 200, 120)
RED = (235, 90, 80)
GREY = (130, 130, 140)
COLOURS = {
    OutcomeKind.SUCCESS: GREEN,
    OutcomeKind.FAILURE: RED,
    None: GREY,
}
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


class Picture:
    """A run as it is drawn.

    Args:
        stream: Where to draw; owned by the caller.
        config: Names and units of the parameters, if known.
    """

    def __init__(self, stream: rr.RecordingStream, config: RunConfig | None) -> None:
        self._rec = stream
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
        for slot, group in enumerate(self._charted(trace)):
            self._chart(slot, group, trace)
        self._path(trace)
        self._rec.reset_time()
        self._play(trace, start_s)

    def _charted(self, trace: Trace) -> list[columns.Group]:
        """Return the groups that get a chart, always the same slot for the same name."""
        found = [
            group
            for group in columns.groups(trace)
            if group.name not in columns.SPATIAL and group.name != "phase"
        ]
        return found[:CHARTS]

    def _chart(self, slot: int, group: columns.Group, trace: Trace) -> None:
        low, high = charts.bounds(*self._seen(group))
        drawn = charts.chart(trace.t_s, group.values, low, high)
        colours = [SERIES[i % len(SERIES)] for i in range(len(drawn.lines))]
        path = f"charts/{slot}"
        thin = rr.Radius.ui_points(1.3)
        self._rec.log(
            f"{path}/lines", rr.LineStrips2D(drawn.lines, colors=colours, radii=thin, draw_order=2)
        )
        faint = rr.Radius.ui_points(0.5)
        self._rec.log(f"{path}/grid", rr.LineStrips2D(drawn.grid, colors=(90, 90, 98), radii=faint))
        self._label(f"{path}/ticks", drawn.marks, drawn.labels, GREY)
        unit = f" [{group.unit}]" if group.unit else ""
        title = f"{group.name}{unit}"
        self._label(
            f"{path}/title", np.array([[charts.WIDTH / 2, -14.0]]), [title], (235, 235, 240)
        )
        if len(group.names) > 1:
            ends = np.array([[charts.WIDTH + 14.0, 12.0 * i] for i in range(len(group.names))])
            short = [name.split(".", 1)[-1] for name in group.names]
            self._rec.log(f"{path}/legend", _labels(ends, short, colours))

    def _seen(self, group: columns.Group) -> tuple[float, float]:
        """Return a group's extremes over all trials so far: on one scale they can be compared."""
        finite = [values[np.isfinite(values)] for values in group.values]
        low = min((float(values.min()) for values in finite if values.size), default=0.0)
        high = max((float(values.max()) for values in finite if values.size), default=0.0)
        was_low, was_high = self._extremes.get(group.name, (low, high))
        self._extremes[group.name] = (min(low, was_low), max(high, was_high))
        return self._extremes[group.name]

    def _label(
        self,
        path: str,
        marks: npt.NDArray[np.float64],
        labels: list[str],
        colour: tuple[int, int, int],
    ) -> None:
        self._rec.log(path, _labels(marks, labels, colour))

    def _path(self, trace: Trace) -> None:
        """Draw the whole path of the tip and the force along it, for the trial's number."""
        tip = columns.tip(trace)
        if tip is None:
            return
        colour = COLOURS[self._kind(trace)]
        thin = tip[:: max(1, -(-len(tip) // charts.POINTS_MAX))]
        radius = rr.Radius.ui_points(1.6)
        self._rec.log("scene/path", rr.LineStrips3D([thin], colors=[colour], radii=radius))
        self._rec.log("scene/end", rr.Points3D([tip[-1]], colors=[colour], radii=0.0008))
        force = columns.force(trace)
        if force is not None:
            at = np.linspace(0, len(tip) - 1, ARROWS).astype(int)
            self._rec.log("scene/forces", _arrows(tip[at], force[at], radius_m=0.00012))
        self._slot(trace, tip)

    def _slot(self, trace: Trace, tip: npt.NDArray[np.float32]) -> None:
        """Draw where the lock must be: a box as deep as the deepest insertion seen went."""
        if "depth" not in trace.columns or self._kind(trace) is not OutcomeKind.SUCCESS:
            return
        depth = trace.columns["depth"][1]
        inside = depth > 0.05 * float(depth.max())
        if inside.sum() < 2:
            return
        mouth, end = tip[inside][0], tip[-1]
        centre, half = (mouth + end) / 2.0, np.abs(end - mouth) / 2.0
        half = np.maximum(half, 0.005)
        self._rec.log(
            "scene/lock",
            rr.Boxes3D(centers=[centre], half_sizes=[half], colors=[(150, 150, 165)], radii=0.0001),
            static=True,
        )

    def _play(self, trace: Trace, start_s: float) -> None:
        """Lay the trial on the ``played`` timeline: signals, moving tip, phases."""
        step = max(1, -(-trace.t_s.size // PLAYED_SAMPLES))
        t_s = start_s + trace.t_s[::step].astype(np.float64)
        played = [rr.TimeColumn("played", duration=t_s)]
        for group in columns.groups(trace):
            if group.name in columns.SPATIAL or group.name == "phase":
                continue
            values = np.stack([column[::step] for column in group.values], axis=1)
            lengths = [values.shape[1]] * len(values)
            scalars = rr.Scalars.columns(scalars=values.ravel().astype(np.float64))
            self._style(group)
            rr.send_columns(
                f"signals/{group.name}", played, scalars.partition(lengths), recording=self._rec
            )
        tip = columns.tip(trace)
        if tip is not None:
            points = rr.Points3D.columns(positions=tip[::step])
            rr.send_columns("scene/tip", played, points, recording=self._rec)
        for at_s, name in trace.events:
            self._rec.set_time("played", duration=start_s + at_s)
            self._rec.log("phase", rr.StateChange(state=name))
        self._rec.set_time("played", duration=self._played_s - PAUSE_S / 2)
        self._rec.log("phase", rr.Clear(recursive=False))
        self._rec.reset_time()

    def _style(self, group: columns.Group) -> None:
        if group.name in self._styled:
            return
        self._styled.add(group.name)
        unit = f" [{group.unit}]" if group.unit else ""
        style = rr.SeriesLines(
            names=[f"{name}{unit}" for name in group.names],
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
