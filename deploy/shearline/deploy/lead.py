"""A learner and the recorder beside it: the two processes that every run has.

The recorder is a client like any other. The trials of a new run wait for it to be ready, for a
moment; those of a run that goes on do not: what was said while there was no learner is missed
anyhow, and the journal has it. After that the learner never looks at it again until the run has
ended.
"""

from __future__ import annotations

import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from shearline.deploy.options import reach
from shearline.learner.dispatcher.observed import history
from shearline.learner.run.config import RunConfig
from shearline.learner.run.folder import JOURNAL
from shearline.learner.run.journal import read
from shearline.learner.run.serving import serve
from shearline.learner.run.summary import RunSummary
from shearline.protocol.endpoints import check_endpoint
from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Counted, EpisodeClosed
from shearline.record.start import spawn
from shearline.record.tally import tally
from shearline.record.topics import TOPICS

#: A recorder starts within a second; a run does not wait longer than this for it [s].
READY_S = 10.0
#: The last traces arrive within a moment of the run's end [s].
TRAILING_S = 2.0
#: How long the recorder may take to write what is left once the run has ended [s].
FINISH_S = 10.0


def lead(
    config: RunConfig,
    run_dir: Path,
    listen: str,
    *,
    through: str | None = None,
    resume: bool = False,
) -> RunSummary:
    """Lead a run to its end and complete its record; see :func:`shearline.learner.run.serve`.

    ``through`` is the endpoint of a Zenoh router where evaluators may connect as well; it may come
    later than the learner, and be restarted. A malformed one is a ``LinkError`` too.
    """
    settings = {"connect/endpoints": [check_endpoint(through)]} if through else None
    recorder: list[subprocess.Popen[str]] = []
    is_new = not (run_dir / JOURNAL).exists()
    starting = threading.Thread(
        target=lambda: recorder.append(_started(listen, run_dir)), name="recorder-start"
    )

    def begin() -> None:
        if config.record:
            starting.start()
        if config.record and is_new:
            starting.join()

    try:
        summary = serve(
            config, run_dir, listen, resume=resume, on_listening=begin, settings=settings
        )
    finally:
        if starting.ident is not None:
            starting.join()
        for process in recorder:
            _finish(process)
    if config.record:
        _complete(run_dir)
    return summary


def _started(listen: str, run_dir: Path) -> subprocess.Popen[str]:
    """Start a recorder and return it once it is ready, or will not be."""
    recorder = spawn(reach(listen), run_dir.resolve().name, run_dir)
    _wait_until_ready(recorder)
    return recorder


def _wait_until_ready(recorder: subprocess.Popen[str]) -> None:
    """Wait for its one line, or for its end; in a thread, because a pipe cannot be timed."""
    assert recorder.stdout is not None
    reader = threading.Thread(target=recorder.stdout.readline, daemon=True)
    reader.start()
    reader.join(READY_S)
    if recorder.poll() is not None or reader.is_alive():
        _say("the recorder did not start: this run goes on without a record")


def _finish(recorder: subprocess.Popen[str]) -> None:
    """Let the recorder write what is on its way, then have it end."""
    try:
        recorder.wait(TRAILING_S)  # it ends by itself once the end was heard and all is quiet
    except subprocess.TimeoutExpired:
        recorder.terminate()
    try:
        recorder.wait(FINISH_S)
    except subprocess.TimeoutExpired:
        recorder.kill()  # what it wrote is sealed when the record is completed
        recorder.wait()


def _complete(run_dir: Path) -> None:
    """Put into the record what the journal has and it has not; a full disk is not a lost run."""
    journal = list(outcomes(run_dir))
    said = Counter(TOPICS[type(message)].name for message in journal)
    on_record = tally(run_dir)
    if on_record is not None and all(on_record[topic] == n for topic, n in said.items()):
        return  # nothing was dropped and nobody killed: the record need not be read for that
    from shearline.record.complete import complete  # noqa: PLC0415 - loads the formats of records

    try:
        missing = complete(run_dir, journal)
    except (RecordError, OSError) as error:
        _say(f"the record is incomplete: {error}; the journal has everything")
        return
    if missing:
        _say(f"{missing} messages were added to the record from the journal")


def outcomes(run_dir: Path) -> Iterator[Counted | EpisodeClosed]:
    """Yield what a run's journal says that observers should have heard."""
    for message in history(read(run_dir / JOURNAL)):
        if isinstance(message, Counted | EpisodeClosed):
            yield message


def _say(text: str) -> None:
    print(f"shearline: {text}", file=sys.stderr, flush=True)
