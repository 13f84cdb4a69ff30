"""A replayed trial in Rerun: one recording of what is on record, one of what came out again.

Both are drawn by the same hand as a whole run is, so that they can be held against each other.
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from pathlib import Path

import msgspec
import rerun as rr

from shearline.evaluator.replay import Replayed
from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Counted, OutcomeKind
from shearline.record.picture import Picture
from shearline.record.reader import Run, Trace, to_trace
from shearline.record.view import APPLICATION, layout_for
from shearline.record.viewer import check_ended_well, executable, quiet_environment, viewer


def view(run: Run, replayed: Replayed) -> None:
    """Show the recorded and the replayed trial in the viewer; returns when it is closed.

    Raises:
        RecordError: If there is no viewer or no screen.
    """
    with tempfile.TemporaryDirectory(prefix="shearline-replay-") as folder:
        paths = recordings(run, replayed, Path(folder))
        with viewer([str(path) for path in paths]) as child:
            check_ended_well(child)


def save(run: Run, replayed: Replayed, path: Path) -> None:
    """Write both recordings into one Rerun file.

    Raises:
        RecordError: If the viewer, which merges them, is missing or cannot write there.
    """
    with tempfile.TemporaryDirectory(prefix="shearline-replay-") as folder:
        paths = [str(part) for part in recordings(run, replayed, Path(folder))]
        with quiet_environment() as environment:
            merged = subprocess.run(  # noqa: S603 - the viewer we depend on, our own arguments
                [executable(), "rrd", "merge", *paths, "-o", str(path)],
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
    if merged.returncode != 0:
        said = merged.stderr.strip().splitlines() or ["no reason given"]
        raise RecordError(f"{path} cannot be written: {said[-1]}")


def recordings(run: Run, replayed: Replayed, folder: Path) -> list[Path]:
    """Write a Rerun file for each that there is, recorded and replayed, and return their paths."""
    case, paths = replayed.case, []
    if case.outcome is not None:
        traces = run.traces(case.trial)
        paths.append(_draw(run, "recorded", folder, case.outcome, traces[-1] if traces else None))
    message = replayed.trace_data()
    trace = None if message is None else to_trace(message)
    paths.append(_draw(run, "replayed", folder, as_outcome(replayed), trace))
    return paths


def as_outcome(replayed: Replayed) -> Counted:
    """Return how a replayed trial ended as the message that would be on record."""
    case, verdict = replayed.case, replayed.verdict
    judged = verdict.kind in {OutcomeKind.SUCCESS, OutcomeKind.FAILURE}
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


def _draw(run: Run, name: str, folder: Path, outcome: Counted, trace: Trace | None) -> Path:
    path = folder / f"{name}.rrd"
    label = f"trial {outcome.trial}, {name}"
    stream = rr.RecordingStream(APPLICATION, recording_id=f"{run.name} {label}")
    stream.save(path, default_blueprint=layout_for(run.config, trace))
    stream.send_recording_name(label)
    picture = Picture(stream, run.config)
    picture.outcome(msgspec.structs.replace(outcome, evaluator=outcome.evaluator or name))
    if trace is not None:
        picture.trace(trace)
    stream.flush()
    stream.disconnect()
    return path
