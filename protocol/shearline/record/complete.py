"""Completes a record from the journal: outcomes that a killed recorder never saw.

The journal is the truth for what was counted; the record is what people look at. Nothing here
reads a journal: whoever can hands over its messages.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path

from shearline.protocol.messages import Counted, EpisodeClosed
from shearline.record.foxglove import Level
from shearline.record.head import config_of
from shearline.record.reader import open_run
from shearline.record.seal import seal_all
from shearline.record.writer import RecordWriter


def complete(run_dir: Path, journal: Iterable[Counted | EpisodeClosed]) -> int:
    """Append to the record what the journal has and the record has not, in a new part.

    Torn parts are sealed first. Trials are told apart by number, episodes likewise.

    Args:
        run_dir: The run folder.
        journal: Outcomes and closed episodes, in order.

    Returns:
        How many messages were missing.

    Raises:
        RecordError: If the missing messages cannot be written.
    """
    seal_all(run_dir)
    run = open_run(run_dir)
    trials = {row.trial for row in run.outcomes}
    episodes = {row.episode for row in run.episodes}
    missing = [
        message
        for message in journal
        if (
            message.trial not in trials
            if isinstance(message, Counted)
            else message.episode not in episodes
        )
    ]
    if missing:
        _append(run_dir, run.name or run_dir.name, missing)
    return len(missing)


def _append(run_dir: Path, name: str, missing: list[Counted | EpisodeClosed]) -> None:
    now_ns = time.time_ns()
    with RecordWriter(run_dir, config_of(name, run_dir)) as writer:
        for message in missing:
            writer.write(message, log_ns=now_ns, publish_ns=int(message.at_s * 1e9))
        text = f"{len(missing)} messages completed from the journal"
        writer.log(Level.INFO, text, log_ns=now_ns)
