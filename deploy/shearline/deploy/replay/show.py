"""A replayed trial in Rerun: what is on record and what came out, side by side on one clock.

The pages are those of ``shearline view RUN --trial A --beside B``; only that here both are the same
trial. A trial that never ended has one page.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import rerun as rr

from shearline.evaluator.replay import Replayed
from shearline.protocol.messages import JUDGED, Counted
from shearline.record.layout import Shape, pages
from shearline.record.page import ROOTS, draw_page
from shearline.record.reader import Run, Trace, to_trace
from shearline.record.view import APPLICATION, connected, shape_for
from shearline.record.viewer import check_ended_well, free_port, viewer


def view(run: Run, replayed: Replayed) -> None:
    """Show both in the viewer; returns when it is closed.

    Raises:
        RecordError: If there is no viewer or no screen.
    """
    port = free_port()
    with viewer([], port) as child:
        stream = connected(port)
        stream.send_blueprint(pages(shape(run, replayed)))
        draw(stream, run, replayed)
        stream.flush()
        check_ended_well(child)


def save(run: Run, replayed: Replayed, path: Path) -> None:
    """Write both into one Rerun file."""
    stream = rr.RecordingStream(APPLICATION, recording_id=f"{run.name} {replayed.case.trial}")
    stream.save(path, default_blueprint=pages(shape(run, replayed)))
    draw(stream, run, replayed)
    stream.flush()
    stream.disconnect()


def draw(stream: rr.RecordingStream, run: Run, replayed: Replayed) -> None:
    """Draw the page of each."""
    shown = _pages(run, replayed).values()
    for root, (outcome, traces) in zip(ROOTS, shown, strict=False):
        draw_page(stream, root, outcome, traces, run.config, run.scene)


def shape(run: Run, replayed: Replayed) -> Shape:
    """Return what the layout has to have room for."""
    shown = _pages(run, replayed)
    trace = next((traces[-1] for _, traces in shown.values() if traces), None)
    trials = [replayed.case.trial] * len(shown)
    return replace(
        shape_for(run.config, trace, run.scene, trials=trials),
        titles=[f"trial {replayed.case.trial}, {name}" for name in shown],
    )


def as_outcome(replayed: Replayed) -> Counted:
    """Return how a replayed trial ended as the message that would be on record."""
    case, verdict = replayed.case, replayed.verdict
    judged = verdict.kind in JUDGED
    return Counted(
        trial=case.trial,
        episode=case.outcome.episode if case.outcome else 0,
        theta=list(replayed.theta),
        kind=verdict.kind if judged else None,
        cost=verdict.cost,
        seed=replayed.seed,
        evaluator="replay",
        attempts=1,
        late=False,
        engine=replayed.engine,
        digest=replayed.digest,
        wall_s=verdict.wall_s,
        why=verdict.why,
        extras=dict(verdict.extras),
        at_s=case.outcome.at_s if case.outcome else time.time(),
    )


def _pages(run: Run, replayed: Replayed) -> dict[str, tuple[Counted, list[Trace]]]:
    """Return outcome and traces of what is on record, if it is, and of what came out."""
    shown = {}
    if replayed.case.outcome is not None:
        shown["recorded"] = (replayed.case.outcome, run.traces(replayed.case.trial))
    message = replayed.trace_data()
    traces = [] if message is None else [to_trace(message)]
    shown["replayed"] = (as_outcome(replayed), traces)
    return shown
