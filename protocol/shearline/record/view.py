"""Shows a run in Rerun: from its folder, into a file, or live while it is learned.

Whatever happens to the viewer, nobody in the run waits for it: a live view is one more observer
with a bounded inbox. What is drawn, and where, is said elsewhere.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import rerun as rr

from shearline.protocol import codec
from shearline.protocol.discovery import discover
from shearline.protocol.errors import ProtocolError, RecordError
from shearline.protocol.keys import Keys
from shearline.protocol.link import open_client
from shearline.protocol.messages import (
    Counted,
    EpisodeClosed,
    EvaluatorState,
    Message,
    Snapshot,
    Status,
    TraceData,
)
from shearline.protocol.scene import SceneData
from shearline.record import columns
from shearline.record.bodies import paths
from shearline.record.drain import Drain
from shearline.record.inbox import Inbox
from shearline.record.layout import Shape, layout
from shearline.record.page import ROOTS, draw_page
from shearline.record.picture import Picture
from shearline.record.ranks import choose, ranks
from shearline.record.reader import Run, Trace, open_run, to_trace
from shearline.record.slices import SLICES
from shearline.record.topics import RunConfig
from shearline.record.viewer import check_ended_well, free_port, viewer

APPLICATION = "shearline"
#: Traces kept waiting for a slow viewer; older ones are left out of a live view.
LIVE_BULK_BYTES = 16 * 2**20
TICK_S = 0.1
#: Traces drawn before they are handed to the viewer's library: bounds memory.
FLUSH_TRACES = 250


def save(run_dir: Path | str, path: Path | str, *, trials: Sequence[str] = ()) -> Run:
    """Write the view of a run into a Rerun file, for machines without a screen.

    Args:
        run_dir: The run folder.
        path: File to write, ending in ``.rrd``.
        trials: At most two trials to show in full, as :func:`shearline.record.ranks.choose` reads
            them.

    Returns:
        The run that was drawn; its ``damage`` says what could not be read.

    Raises:
        RecordError: If there is no such run folder or trial, a trace cannot be read, or the file
            cannot be written.
    """
    run = open_run(run_dir)
    chosen = numbers(run, trials)
    stream = rr.RecordingStream(APPLICATION, recording_id=f"{run.name or run.run_dir.name}")
    try:
        stream.save(path, default_blueprint=layout(shape_of(run, chosen)))
        draw_all(stream, run, chosen)
        stream.flush()
    except RuntimeError as error:  # the library's word for a full disk
        raise RecordError(f"the view cannot be written to {path}: {error}") from error
    stream.disconnect()
    return run


def view(run_dir: Path | str, *, trials: Sequence[str] = ()) -> Run:
    """Show a run in the viewer; returns when the viewer is closed.

    The window is there at once, outcomes follow within seconds, traces after them.

    Args:
        run_dir: The run folder.
        trials: As for :func:`save`.

    Raises:
        RecordError: If there is no such run folder or trial, no viewer, or no screen.
    """
    run = open_run(run_dir)
    chosen = numbers(run, trials)
    port = free_port()
    with viewer([], port) as child:
        stream = connected(port)
        stream.send_blueprint(layout(shape_of(run, chosen)))
        draw_all(stream, run, chosen, closed=lambda: child.poll() is not None)
        check_ended_well(child)
    return run


def connected(port: int) -> rr.RecordingStream:
    """Return a stream to the viewer that listens on a port of this machine."""
    stream = rr.RecordingStream(APPLICATION)
    stream.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy")
    return stream


def numbers(run: Run, words: Sequence[str]) -> list[int]:
    """Return the numbers of the trials that are to have a page.

    Raises:
        RecordError: If there is no such trial.
    """
    return [choose(run.outcomes, word) for word in words]


def draw_all(
    stream: rr.RecordingStream,
    run: Run,
    trials: Sequence[int] = (),
    *,
    closed: Callable[[], bool] = lambda: False,
) -> None:
    """Draw the pages of some trials, then the run; give up once ``closed`` says so."""
    outcomes = {outcome.trial: outcome for outcome in run.outcomes}
    for root, trial in zip(ROOTS, trials, strict=False):
        draw_page(stream, root, outcomes[trial], run.traces(trial), run.config, run.scene)
    draw(stream, run, closed=closed)


def draw(
    stream: rr.RecordingStream, run: Run, *, closed: Callable[[], bool] = lambda: False
) -> Picture:
    """Draw everything a run has on record; return the picture, to be drawn on.

    A viewer that does not keep up is waited for, unless ``closed`` says that it is gone.
    """
    drain = Drain(stream)
    picture = Picture(
        stream,
        run.config,
        scene=run.scene,
        n_trials=len(run.traced()),
        ranks=ranks(run.outcomes),
    )
    _draw_outcomes(picture, run)
    for drawn, trace in enumerate(run.all_traces(), start=1):
        picture.trace(trace)
        if drawn % FLUSH_TRACES == 0:
            picture.flush()
            if not drain.wait(closed):
                return picture
    picture.flush()
    drain.wait(closed)
    return picture


def _draw_outcomes(picture: Picture, run: Run) -> None:
    """Draw what is there without any trace, and have it shown at once."""
    for outcome in run.outcomes:
        picture.outcome(outcome)
    for episode in run.episodes:
        picture.episode(episode)
    for state in run.evaluators:
        picture.evaluator(state)
    _draw_partition(picture, run)
    picture.flush()


def _draw_partition(picture: Picture, run: Run) -> None:
    """Draw each episode's model from the first of its trials on."""
    picture.choose_slices(run.outcomes)
    first_trial: dict[int, int] = {}
    for proposed in run.proposed.values():
        known = first_trial.get(proposed.episode, proposed.trial)
        first_trial[proposed.episode] = min(known, proposed.trial)
    for snapshot in run.snapshots:
        picture.snapshot(snapshot, first_trial.get(snapshot.episode))


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
        drain, live, shown_s = Drain(stream), _Live(stream, so_far, closed), 0.0
        ready()
        while not closed():
            item = inbox.get(TICK_S)
            if item is not None:
                live.take(item.payload)
            if item is None or time.monotonic() > shown_s + TICK_S:
                live.flush()
                drain.wait(closed)  # meanwhile the inbox keeps what there is room for
                shown_s = time.monotonic()
            if item is None and live.ended:
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
    with viewer([], port) as child:
        stream = connected(port)
        follow(connect, stream, closed=lambda: child.poll() is not None, run_dir=run_dir)
        check_ended_well(child)


class _Live:
    """Draws messages as they come; what it cannot read it leaves out."""

    def __init__(
        self, stream: rr.RecordingStream, so_far: Run | None, closed: Callable[[], bool]
    ) -> None:
        self.ended = False
        self._stream = stream
        self._config = so_far.config if so_far else None
        self._scene = so_far.scene if so_far else None
        self._laid_out = bool(so_far and so_far.traced())
        self._stream.send_blueprint(layout(shape_of(so_far) if so_far else Shape(), live=True))
        self._picture = draw(stream, so_far, closed=closed) if so_far else Picture(stream, None)

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
            case Snapshot():
                self._picture.snapshot(message)
            case SceneData():
                self._see(message)
            case TraceData():
                self._trace(message)
            case Status(state="ended"):
                self.ended = True

    def flush(self) -> None:
        self._picture.flush()

    def _see(self, scene: SceneData) -> None:
        """Take what trials look like, as long as none has been drawn otherwise."""
        if self._scene is None and not self._laid_out:
            self._scene = scene
            self._picture.see(scene)

    def _trace(self, message: TraceData) -> None:
        trace = to_trace(message)
        if not self._laid_out:
            self._laid_out = True
            slices = SLICES if self._config else 0
            shape = shape_for(self._config, trace, self._scene, slices=slices)
            self._stream.send_blueprint(layout(shape, live=True))
        self._picture.trace(trace)


def shape_for(
    config: RunConfig | None,
    trace: Trace | None,
    scene: SceneData | None,
    *,
    slices: int = 0,
    trials: Sequence[int] = (),
) -> Shape:
    """Return what a run has to show whose traces are like this one."""
    if trace is None:
        return Shape(config, slices=slices, trials=trials)
    return Shape(
        config,
        groups=[group.name for group in columns.groups(trace)],
        tip=columns.tip(trace),
        in_lock=columns.in_lock(trace),
        tip_frame=paths(scene)[scene.tip_in] if scene else "",
        has_scene=scene is not None,
        slices=slices,
        trials=trials,
    )


def shape_of(run: Run, trials: Sequence[int] = ()) -> Shape:
    """Return what a run has to show, with pages for some trials."""
    traced = run.traced()
    first = run.traces(traced[0])[0] if traced else None
    slices = SLICES if run.snapshots else 0
    return shape_for(run.config, first, run.scene, slices=slices, trials=trials)
