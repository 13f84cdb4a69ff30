"""The layout made for tuning: what stands where in the viewer, for any task.

One tab shows the run over trials beside the trial under the cursor, others every parameter in its
unit, slices of the partition, and the signals played one trial after another; trials that were
asked for have a page of their own in front. Only entity paths are known here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np
import numpy.typing as npt
import rerun.blueprint as rrb

from shearline.record import charts, page
from shearline.record.panels import CHARTS
from shearline.record.partition import SIDE
from shearline.record.played import PLAYED
from shearline.record.topics import RunConfig


@dataclass(frozen=True, slots=True)
class Shape:
    """What a run has to show, as far as the layout depends on it.

    Attributes:
        config: Names and units of the parameters, if known.
        groups: Names of the groups of columns that traces have, first ones first.
        tip: A typical path of the tip ``(samples, 3)`` [m]; ``None`` if there is none.
        in_lock: Whether the tip is given in the lock's frame, z pointing into it.
        tip_frame: Entity in whose frame the tip is, below the root of a scene; ``""``: the root.
        has_scene: Whether bodies are known.
        slices: How many slices of the partition there are.
        trials: Numbers of the trials that have a page of their own.
        titles: What their pages are called, where a number does not tell them apart.
    """

    config: RunConfig | None = None
    groups: Sequence[str] = ()
    tip: npt.NDArray[np.float32] | None = None
    in_lock: bool = False
    tip_frame: str = ""
    has_scene: bool = False
    slices: int = 0
    trials: Sequence[int] = ()
    titles: Sequence[str] = ()


def layout(shape: Shape, *, active_tab: int = 0, live: bool = False) -> rrb.Blueprint:
    """Return the layout; pages of single trials stand first, tab ``active_tab`` in front.

    Of a ``live`` run the cursor follows the newest trial until somebody moves it.
    """
    tabs = [
        *([_pages(shape)] if shape.trials else []),
        _trials(shape),
        _parameters(shape.config),
        *([_partition(shape)] if shape.slices else []),
        _played(shape),
        _evaluators(),
    ]
    timeline = page.CLOCK if shape.trials and active_tab == 0 else "trial"
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=active_tab),
        rrb.TimePanel(
            timeline=timeline,
            state="collapsed",
            play_state="following" if live else "paused",
        ),
        collapse_panels=True,
    )


def pages(shape: Shape) -> rrb.Blueprint:
    """Return the layout of nothing but the pages of single trials."""
    return rrb.Blueprint(
        _pages(shape),
        rrb.TimePanel(timeline=page.CLOCK, state="collapsed", play_state="paused"),
        collapse_panels=True,
    )


def _trials(shape: Shape) -> rrb.Container:
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
    trial: list[rrb.View | rrb.Container] = []
    if shape.tip is not None:
        trial.append(_tip("scene", "path of the tip, force along it", shape))
    if shape.groups:
        trial.append(rrb.Grid(*(_chart(slot) for slot in range(CHARTS)), grid_columns=2))
    if not trial:
        return rrb.Vertical(run, name="Trials")
    right = rrb.Vertical(*trial, row_shares=[4, 5][: len(trial)])
    return rrb.Horizontal(run, right, column_shares=[2, 3], name="Trials")


def _pages(shape: Shape) -> rrb.Container:
    """Return the pages of single trials, side by side."""
    titles = shape.titles or [f"trial {trial}" for trial in shape.trials]
    shown = [_page(root, title, shape) for root, title in zip(page.ROOTS, titles, strict=False)]
    name = " beside ".join(title.capitalize() for title in titles)
    return rrb.Horizontal(*shown, name=name)


def _page(root: str, title: str, shape: Shape) -> rrb.Container:
    head: list[rrb.View | rrb.Container] = [
        rrb.TextDocumentView(origin=f"/{root}/card", name=title)
    ]
    if shape.tip is not None:
        head.append(_tip(f"{root}/scene", "tip, force, region of interest", shape))
    if shape.has_scene:
        head.append(_arm(f"{root}/scene"))
    phases = rrb.StateTimelineView(origin=f"/{root}/phase", name=f"phases of {title}")
    plots = [
        rrb.TimeSeriesView(origin=f"/{root}/signals/{name}", name=f"{name}, {title}")
        for name in shape.groups[:CHARTS]
    ]
    # side by side, a card beside its scene would leave neither room
    many = len(shape.trials) > 1
    top = rrb.Tabs(*head, active_tab=min(1, len(head) - 1)) if many else rrb.Horizontal(*head)
    return rrb.Vertical(top, phases, *plots, row_shares=[7, 2, *[2] * len(plots)])


def _tip(root: str, name: str, shape: Shape) -> rrb.Spatial3DView:
    assert shape.tip is not None
    origin = f"/{root}/{shape.tip_frame}" if shape.tip_frame else f"/{root}"
    # what stands in front of the lock hides what is to be seen
    front = f"- {origin}/{PurePosixPath(origin).name}.front/**"
    contents = [f"+ /{root}/**", front]
    return rrb.Spatial3DView(
        origin=origin,
        name=name,
        contents=contents,
        eye_controls=_eye(shape.tip, down_z=shape.in_lock),
        line_grid=False,
    )


def _arm(root: str) -> rrb.Spatial3DView:
    eye = rrb.EyeControls3D(
        kind="Orbital",
        position=(1.15, -0.95, 0.75),
        look_target=(0.27, 0.0, 0.36),
        eye_up=(0, 0, 1),
    )
    return rrb.Spatial3DView(origin=f"/{root}", name="scene", eye_controls=eye, line_grid=False)


def _partition(shape: Shape) -> rrb.Container:
    views = [
        rrb.Spatial2DView(
            origin=f"/partition/{slot}",
            name=f"slice {slot + 1}: white is accepted, blue is not",
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-14.0, SIDE + 6.0), y_range=(-8.0, SIDE + 12.0)
            ),
        )
        for slot in range(shape.slices)
    ]
    return rrb.Grid(*views, grid_columns=2, name="Partition")


def _eye(tip: npt.NDArray[np.float32], *, down_z: bool) -> rrb.EyeControls3D:
    """Look at the whole path from the side, a little from above."""
    up = -1.0 if down_z else 1.0
    low, high = tip.min(axis=0), tip.max(axis=0)
    centre = (low + high) / 2.0
    size = max(float(np.linalg.norm(high - low)), 0.01)
    return rrb.EyeControls3D(
        kind="Orbital",
        position=(centre + size * np.array([1.15, -0.5, 0.45 * up])).tolist(),
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


def _played(shape: Shape) -> rrb.Container:
    plots = [
        rrb.TimeSeriesView(origin=f"/signals/{name}", name=name) for name in shape.groups[:PLAYED]
    ]
    phases = rrb.StateTimelineView(origin="/phase", name="phase")
    column = rrb.Vertical(phases, *plots)
    if shape.tip is None:
        return rrb.Vertical(column, name="Played")
    spaces = [_tip("scene", "tip, played", shape)]
    spaces += [_arm("scene")] if shape.has_scene else []
    return rrb.Horizontal(column, rrb.Vertical(*spaces), name="Played")


def _evaluators() -> rrb.Container:
    return rrb.Vertical(
        rrb.StateTimelineView(origin="/evaluators", name="evaluators over the wall clock"),
        name="Evaluators",
    )
