"""What a run came to: the one value that scripts, people and ``summary.json`` read."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import msgspec

from shearline.learner.base import Recommendation
from shearline.learner.dispatcher.desk import Desk
from shearline.learner.dispatcher.instructions import Ending
from shearline.learner.dispatcher.status import Vitals
from shearline.learner.run.advice import Advice, Confirmed, advice, confirmed
from shearline.learner.run.config import RunConfig
from shearline.protocol.errors import RecordError
from shearline.protocol.messages import EpisodeClosed, Purpose


class EpisodeSummary(msgspec.Struct, frozen=True, kw_only=True):
    """One closed episode."""

    episode: int
    trials: int
    successes: int
    success_rate: float
    mean_cost: float | None
    best_cost: float | None


class RunSummary(msgspec.Struct, frozen=True, kw_only=True):
    """One run.

    Attributes:
        state: How it ended; a stopped run can be resumed.
        why: One sentence unless complete.
        episodes: Those that the learner learned from.
        confirmation: Fresh trials of the recommended tuple, if they were asked for.
        region_confirmation: Fresh trials of draws from the recommended region, likewise.
        counted: Trials with an outcome, ``late`` ones and those of a confirmation among them.
        lost: Trials without one.
        wall_s: How long this process worked on it [s].
        step_ms_max: Longest step of the owner thread, by the wall [ms].
        step_cpu_ms_max: Longest step, by the thread's processor time [ms].
        step_cpu_ms_p99: What 99 % of the steps stayed within [ms].
    """

    run: str
    task: str
    learner: str
    seed: int
    episodes: list[EpisodeSummary]
    counted: int
    lost: int
    duplicates: int
    late: int
    aborted: int
    rejected: int
    recommendation: Advice | None
    confirmation: Confirmed | None
    region_confirmation: Confirmed | None
    wall_s: float
    step_ms_max: float
    step_cpu_ms_max: float
    step_cpu_ms_p99: float
    state: Ending
    why: str

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, fit for JSON."""
        plain: dict[str, Any] = msgspec.to_builtins(self)
        return plain


def summarise(
    config: RunConfig,
    desk: Desk,
    recommendation: Recommendation | None,
    *,
    run: str,
    wall_s: float,
    vitals: Vitals,
    ending: Ending,
    why: str,
) -> RunSummary:
    """Return what the desk, and the learner's last word, amount to."""
    book, tally = desk.book, desk.book.tally
    return RunSummary(
        run=run,
        task=config.task.name,
        learner=config.learner,
        seed=config.seed,
        episodes=[_episode(c) for c in book.closed if c.purpose is Purpose.LEARNING],
        counted=tally.counted,
        lost=tally.lost,
        duplicates=tally.surplus + desk.resends,
        late=tally.late,
        aborted=tally.aborted,
        rejected=tally.rejected,
        recommendation=None if recommendation is None else advice(config.space, recommendation),
        confirmation=confirmed(book, recommendation, Purpose.CONFIRMATION),
        region_confirmation=confirmed(book, recommendation, Purpose.REGION),
        wall_s=wall_s,
        step_ms_max=vitals.step_ms_max,
        step_cpu_ms_max=vitals.step_cpu_ms_max,
        step_cpu_ms_p99=vitals.step_cpu_ms_p99,
        state=ending,
        why=why,
    )


def write(path: Path, text: str) -> None:
    """Replace a file as a whole: readers see the old one or the new one.

    Raises:
        RecordError: If it cannot be written.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        beside.write_text(text)
        beside.replace(path)
    except OSError as fault:
        beside.unlink(missing_ok=True)
        raise RecordError(f"cannot write {path}: {fault.strerror}: make room there") from None


def to_json(summary: RunSummary) -> str:
    """Return the summary as one line of JSON."""
    return json.dumps(summary.to_dict(), allow_nan=False)


def _episode(closed: EpisodeClosed) -> EpisodeSummary:
    return EpisodeSummary(
        episode=closed.episode,
        trials=closed.trials,
        successes=closed.successes,
        success_rate=closed.success_rate,
        mean_cost=closed.mean_cost,
        best_cost=closed.best_cost,
    )
