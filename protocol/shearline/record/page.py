"""One trial in full: its card, the scene moving, every signal at its own rate, its phases.

All on the timeline ``t``, the trial's own clock, so that two trials side by side are at the same
moment. Entities stand below one root for each trial; how they are laid out is said elsewhere.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence

import numpy as np
import rerun as rr

from shearline.protocol.messages import Counted
from shearline.protocol.scene import SceneData
from shearline.record import columns
from shearline.record.card import card
from shearline.record.goal import Goal
from shearline.record.palette import COLOURS, series
from shearline.record.reader import Trace
from shearline.record.sheet import Sheet, Times
from shearline.record.space import Space
from shearline.record.topics import RunConfig

#: Roots of the pages, in the order in which trials are asked for.
ROOTS = ("a", "b")
#: The trial's own clock.
CLOCK = "t"
#: A force and the scene look smooth at this rate [Hz]; curves have every sample.
SCENE_HZ = 100.0


def draw_page(
    stream: rr.RecordingStream,
    root: str,
    outcome: Counted,
    traces: Sequence[Trace],
    config: RunConfig | None,
    scene: SceneData | None,
) -> None:
    """Draw one trial below ``root``; of several traced attempts the last one."""
    sheet = Sheet(stream)
    text = rr.TextDocument(card(outcome, config), media_type="text/markdown")
    sheet.static(f"{root}/card", text)
    if traces and traces[-1].t_s.size:
        settings = tomllib.loads(config.text) if config else {}
        trace = traces[-1]
        _signals(sheet, root, trace, columns.limits_of(settings))
        space = Space(sheet, f"{root}/scene", scene, Goal.of(settings))
        _in_space(space, outcome, trace)
    sheet.flush()


def _signals(sheet: Sheet, root: str, trace: Trace, limits: columns.Limits) -> None:
    times = {CLOCK: trace.t_s.astype(np.float64)}
    for group in columns.groups(trace, limits):
        path = f"{root}/signals/{group.name}"
        names = [f"{name} [{group.unit}]" for name in group.names]
        sheet.static(path, rr.SeriesLines(names=names, colors=series(len(names))))
        values = np.stack(group.values, axis=1).astype(np.float64)
        sheet.rows(path, times, rr.Scalars, each=values.shape[1], scalars=values.ravel())
    for at_s, name in trace.events:
        sheet.row(f"{root}/phase", {CLOCK: at_s}, rr.StateChange, state=[name])


def _in_space(space: Space, outcome: Counted, trace: Trace) -> None:
    kept = _steps(trace)
    times = {CLOCK: trace.t_s[kept].astype(np.float64)}
    start: Times = {CLOCK: np.zeros(1)}
    plain = {name: values[kept] for name, values in columns.plain(trace).items()}
    space.style()
    space.stand(trace.placed, plain, start)
    space.move(plain, times)
    tip, force = columns.tip(trace), columns.force(trace)
    if tip is None:
        return
    space.path(tip, COLOURS.get(outcome.kind, COLOURS[None]), start)
    space.tip(tip[kept], times)
    if force is not None:
        space.force(tip[kept], force[kept], times)
    if columns.in_lock(trace):
        space.goal()


def _steps(trace: Trace) -> slice:
    """Return which samples the scene takes, at most :data:`SCENE_HZ` of them a second."""
    span_s = float(trace.t_s[-1] - trace.t_s[0])
    rate_hz = (trace.t_s.size - 1) / span_s if span_s > 0.0 else SCENE_HZ
    return slice(None, None, max(1, int(rate_hz / SCENE_HZ)))
