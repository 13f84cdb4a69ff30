"""Shows a run in Rerun: from its folder, into a file, or live while it is learned.

Whatever happens to the viewer, nobody in the run waits for it: a live view is one more observer
with a bounded inbox. What is drawn, and where, is said elsewhere.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from shearline.protocol import codec
from shearline.protocol.errors import ProtocolError
from shearline.protocol.keys import Keys
from shearline.protocol.link import discover, open_client
from shearline.protocol.messages import (
    Counted,
    EpisodeClosed,
    EvaluatorState,
    Message,
    Status,
    TraceData,
)
from shearline.record import columns
from shearline.record.inbox import Inbox
from shearline.record.layout import layout
from shearline.record.picture import Picture
from shearline.record.reader import Run, Trace, open_run, to_trace
from shearline.record.topics import RunConfig
from shearline.record.viewer import check_ended_well, free_port, viewer

APPLICATION = "shearline"
#: Traces kept waiting for a slow viewer; older ones are left out of a live view.
LIVE_BULK_BYTES = 16 * 2**20
TICK_S = 0.1


def save(run_dir: Path | str, path: Path | str) -> Run:
    """Write the view of a run into a Rerun file, for machines without a screen.

    Args:
        run_dir: The run folder.
        path: File to write, ending in ``.rrd``.

    Returns:
        The run that was drawn; its ``damage`` says what could not be read.

    Raises:
        RecordError: If there is no such run folder, or a trace cannot be read.
    """
    run = open_run(run_dir)
    stream = rr.RecordingStream(APPLICATION, recording_id=f"{run.name or run.run_dir.name}")
    stream.save(path, default_blueprint=layout_of(run))
    draw(stream, run)
    stream.flush()
    stream.disconnect()
    return run


def view(run_dir: Path | str) -> Run:
    """Show a run in the viewer; returns when the viewer is closed.

    Raises:
        RecordError: If there is no such run folder, no viewer, or no screen.
    """
    with tempfile.TemporaryDirectory(prefix="shearline-view-") as folder:
        path = Path(folder) / "run.rrd"
        run = save(run_dir, path)
        with viewer([str(path)]) as child:
            check_ended_well(child)
    return run


def draw(stream: rr.RecordingStream, run: Run) -> Picture:
    """Draw everything a run has on record; return the picture, to be drawn on."""
    picture = Picture(stream, run.config)
    for outcome in run.outcomes:
        picture.outcome(outcome)
    last_trial = {outcome.episode: outcome.trial for outcome in run.outcomes}
    for episode in run.episodes:
        picture.episode(episode, last_trial.get(episode.episode))
    for state in run.evaluators:
        picture.evaluator(state)
    for trace in run.all_traces():
        picture.trace(trace)
    return picture


def follow(
    connect: str,
    stream: rr.RecordingStream,
    *,
    closed: Callable[[], bool],
    run_dir: Path | None = None,
    ready: Callable[[], None] = lambda: None,
    timeout_s: float = 5.0,
) -> None:
    """Draw a running run into a stream until it ends or ``closed`` says so.

    Args:
        connect: The learner's endpoint.
        stream: Where to draw.
        closed: Asked ten times a second.
        run_dir: The run's folder, if it is at hand: what it has on record is drawn first.
        ready: Called once everything said from now on will be drawn.
        timeout_s: How long to look for a learner [s].

    Raises:
        LinkError: If no learner is alive at ``connect``.
    """
    inbox = Inbox(bulk_bytes_max=LIVE_BULK_BYTES)
    with open_client(connect, timeout_s) as link:
        run, _ = discover(link, timeout_s)
        link.subscribe(Keys(run).observed(), inbox)
        link.watch(Keys(run).live_learners(), inbox)
        inbox.wait_for_learner(timeout_s)
        so_far = open_run(run_dir) if run_dir else None
        live = _Live(stream, so_far)
        ready()
        while not closed():
            item = inbox.get(TICK_S)
            if item is not None:
                live.take(item.payload)
            elif live.ended:
                return


def view_live(connect: str, run_dir: Path | None = None) -> None:
    """Show a running run in the viewer; returns when the viewer is closed.

    Args:
        connect: The learner's endpoint.
        run_dir: The run's folder, if it is at hand; else the view begins with what comes.

    Raises:
        LinkError: If no learner is alive at ``connect``.
        RecordError: If there is no viewer or no screen.
    """
    port = free_port()
    stream = rr.RecordingStream(APPLICATION)
    with viewer([], port) as child:
        stream.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy")
        follow(connect, stream, closed=lambda: child.poll() is not None, run_dir=run_dir)
        check_ended_well(child)


class _Live:
    """Draws messages as they come; what it cannot read it leaves out."""

    def __init__(self, stream: rr.RecordingStream, so_far: Run | None) -> None:
        self.ended = False
        self._stream = stream
        self._config = so_far.config if so_far else None
        self._laid_out = bool(so_far and so_far.traced())
        self._stream.send_blueprint(layout_of(so_far) if so_far else layout_for(None, None))
        self._picture = draw(stream, so_far) if so_far else Picture(stream, None)

    def take(self, payload: bytes) -> None:
        try:
            message: Message = codec.decode(payload, *codec.TO_OBSERVER)
        except ProtocolError:
            return
        match message:
            case Counted():
                self._picture.outcome(message)
            case EpisodeClosed():
                self._picture.episode(message)
            case EvaluatorState():
                self._picture.evaluator(message)
            case TraceData():
                self._trace(message)
            case Status(state="ended"):
                self.ended = True

    def _trace(self, message: TraceData) -> None:
        trace = to_trace(message)
        if not self._laid_out:
            self._laid_out = True
            self._stream.send_blueprint(layout_for(self._config, trace))
        self._picture.trace(trace)


def layout_for(
    config: RunConfig | None, trace: Trace | None, *, active_tab: int = 0
) -> rrb.Blueprint:
    """Return the layout for a run whose traces are like this one."""
    if trace is None:
        return layout(config, [], tip=None, active_tab=active_tab)
    return layout(
        config,
        [group.name for group in columns.groups(trace)],
        tip=columns.tip(trace),
        in_lock=columns.in_lock(trace),
        active_tab=active_tab,
    )


def layout_of(run: Run, *, active_tab: int = 0) -> rrb.Blueprint:
    """Return the layout for a run, with one of its tabs in front."""
    traced = run.traced()
    first = run.traces(traced[0])[0] if traced else None
    return layout_for(run.config, first, active_tab=active_tab)
