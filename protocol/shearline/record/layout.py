"""The layout made for tuning: what stands where in the viewer, for any task.

Tab one shows the run over trials beside the trial under the cursor; tab two every parameter in
its unit; tab three the signals, played one trial after another. Only entity paths of
:mod:`shearline.record.picture` are known here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import rerun.blueprint as rrb

from shearline.record import charts
from shearline.record.picture import CHARTS, PLAYED
from shearline.record.topics import RunConfig


def layout(
    config: RunConfig | None,
    groups: Sequence[str],
    *,
    tip: npt.NDArray[np.float32] | None,
    in_lock: bool = False,
    active_tab: int = 0,
) -> rrb.Blueprint:
    """Return the layout.

    Args:
        config: Names and units of the parameters, if known.
        groups: Names of the groups of columns that traces have, first ones first.
        tip: A typical path of the tip ``(samples, 3)`` [m], to look at; ``None`` if there is none.
        in_lock: Whether the tip is given in the lock's frame, z pointing into it.
        active_tab: Which tab stands in front.
    """
    eye = _eye(tip, down_z=in_lock) if tip is not None and len(tip) else None
    tabs = rrb.Tabs(
        _trials(eye, has_traces=bool(groups)),
        _parameters(config),
        _played(groups, eye),
        _evaluators(),
        active_tab=active_tab,
    )
    return rrb.Blueprint(
        tabs,
        rrb.TimePanel(timeline="trial", state="collapsed", play_state="paused"),
        collapse_panels=True,
    )


def _trials(eye: rrb.EyeControls3D | None, *, has_traces: bool) -> rrb.Container:
    run = rrb.Vertical(
        rrb.TimeSeriesView(
            origin="/success_rate",
            name="success per episode [%], one standard error",
            axis_y=rrb.ScalarAxis(range=(0.0, 105.0)),
            plot_legend=rrb.PlotLegend(visible=False),
        ),
        rrb.TimeSeriesView(
            origin="/cost",
            name="cost per trial",
            plot_legend=rrb.PlotLegend(corner="RightTop"),
        ),
        rrb.TextDocumentView(origin="/card", name="trial under the cursor"),
        row_shares=[2, 3, 4],
    )
    trial = [_space("path of the tip, force along it", eye)] if eye else []
    if has_traces:
        trial.append(rrb.Grid(*(_chart(slot) for slot in range(CHARTS)), grid_columns=2))
    if not trial:
        return rrb.Vertical(run, name="Trials")
    right = rrb.Vertical(*trial, row_shares=[4, 5][: len(trial)])
    return rrb.Horizontal(run, right, column_shares=[2, 3], name="Trials")


def _space(name: str, eye: rrb.EyeControls3D) -> rrb.Spatial3DView:
    return rrb.Spatial3DView(origin="/scene", name=name, eye_controls=eye, line_grid=False)


def _eye(tip: npt.NDArray[np.float32], *, down_z: bool) -> rrb.EyeControls3D:
    """Look at the whole path from the side, a little from above."""
    up = -1.0 if down_z else 1.0
    low, high = tip.min(axis=0), tip.max(axis=0)
    centre = (low + high) / 2.0
    size = max(float(np.linalg.norm(high - low)), 0.01)
    return rrb.EyeControls3D(
        kind="Orbital",
        position=(centre + size * np.array([0.9, -0.9, 0.5 * up])).tolist(),
        look_target=centre.tolist(),
        eye_up=[0.0, 0.0, up],
    )


def _chart(slot: int) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(
        origin=f"/charts/{slot}",
        name=f"chart {slot + 1}",
        titlebar=False,
        visual_bounds=rrb.VisualBounds2D(
            x_range=(-20.0, charts.WIDTH + 24.0), y_range=(-16.0, charts.HEIGHT + 14.0)
        ),
    )


def _parameters(config: RunConfig | None) -> rrb.Container:
    if config is None or not config.names:
        return rrb.Vertical(rrb.TimeSeriesView(origin="/parameters"), name="Parameters")
    views = [
        rrb.TimeSeriesView(
            origin=f"/parameters/{name}",
            name=f"{name} [{unit}]" if unit else name,
            axis_y=rrb.ScalarAxis(range=(low, high)),
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for name, unit, low, high in zip(
            config.names, config.units, config.low, config.high, strict=True
        )
    ]
    return rrb.Grid(*views, name="Parameters")


def _played(groups: Sequence[str], eye: rrb.EyeControls3D | None) -> rrb.Container:
    plots = [rrb.TimeSeriesView(origin=f"/signals/{name}", name=name) for name in groups[:PLAYED]]
    phases = rrb.StateTimelineView(origin="/phase", name="phase")
    column = rrb.Vertical(phases, *plots)
    if eye is None:
        return rrb.Vertical(column, name="Played")
    return rrb.Horizontal(column, _space("tip, played", eye), name="Played")


def _evaluators() -> rrb.Container:
    return rrb.Vertical(
        rrb.StateTimelineView(origin="/evaluators", name="evaluators over the wall clock"),
        name="Evaluators",
    )
