"""The repeats of a study, got: from its results where they are there, else from a run.

This is what makes ``shearline study fig4`` resumable: kill it, start it again, and only what is
missing is run.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from shearline.deploy.launch import RunFailed
from shearline.deploy.studies.batch import folders, harvest, launch
from shearline.deploy.table import duration, time_left_s
from shearline.protocol.messages import Status
from shearline.studies.curves import curves
from shearline.studies.provenance import code_of
from shearline.studies.repeat import Job, Repeat
from shearline.studies.store import Store

#: The file of results in a study's folder.
RESULTS = "repeats.jsonl"
#: How often a run's journal is looked into [s]: reading it whole costs a tenth of a second.
HARVEST_S = 5.0


@dataclass(slots=True)
class Progress:
    """Takes results over while a batch runs, and says which curves are complete.

    Args:
        store: Where results go.
        run_dir: The batch's folder.
        wanted: All jobs of the study.
        missing: Those that the batch runs.
        quiet: Whether to keep complete curves to itself.
    """

    store: Store
    run_dir: Path
    wanted: Sequence[Job]
    missing: Sequence[Job]
    quiet: bool
    _next_s: float = field(default=0.0, init=False)
    _lacking: Counter[Job] = field(init=False)

    def __post_init__(self) -> None:
        self._lacking = Counter(_cell(job) for job in self.missing)

    @property
    def lacking(self) -> int:
        """How many repeats of the batch have not come yet."""
        return self._lacking.total()

    def update(self, status: Status) -> None:
        """Look into the journal now and then, and show how far the batch is."""
        if time.monotonic() >= self._next_s:
            self.take()
            self._next_s = time.monotonic() + HARVEST_S
        total = status.episodes * status.trials_per_episode
        _show(
            f"{status.counted} of {total} repeats, {status.rate_hz:.2f}/s,"
            f" {duration(time_left_s(status))} left"
        )

    def say(self, text: str) -> None:
        """Print what happened to a process, for people."""
        _show("")
        print(f"{time.strftime('%H:%M:%S')} {text}", file=sys.stderr, flush=True)

    def take(self) -> None:
        """Take over what the journal has and the results have not."""
        for one in self.store.add(harvest(self.run_dir)):
            cell = _cell(one.job)
            self._lacking[cell] -= 1
            if self._lacking[cell] == 0 and not self.quiet:
                self._announce(cell)

    def _announce(self, cell: Job) -> None:
        done = [self.store[job] for job in self.wanted if _cell(job) == cell]
        _show("")
        for curve in curves(done):
            print(
                f"{curve.function}, {curve.placement}, {curve.dimensions} parameters,"
                f" {curve.learner}: best {curve.final} ({curve.runs} runs,"
                f" {curve.learner_s:.2f} s of learner each)",
                flush=True,
            )


def gather(
    study: Path,
    wanted: Sequence[Job],
    *,
    workers: int,
    listen: str | None = None,
    renew: bool = False,
    quiet: bool = False,
) -> list[Repeat]:
    """Return the repeats of all jobs, running those that the study's folder does not hold.

    Args:
        study: The study's folder; made if missing.
        wanted: Jobs, in the order in which they are run.
        workers: Evaluators on this machine.
        listen: Endpoint where evaluators of other machines may join.
        renew: Run again what was made by other code of the same learner.
        quiet: Print nothing but trouble.

    Raises:
        RunFailed: If a repeat could not be run.
        KeyboardInterrupt: If it was interrupted; what was done is kept.
        RecordError: If the folder cannot be used, or another study is at work there.
    """
    with Store(study / RESULTS) as store:
        for run_dir in folders(study):
            store.add(harvest(run_dir))
        old = _outdated(store, wanted)
        if old and not renew:
            _warn(old)
        missing = [job for job in wanted if job not in store or (renew and job in old)]
        if missing:
            _run(study, store, wanted, missing, workers=workers, listen=listen, quiet=quiet)
        return [store[job] for job in wanted]


def _run(
    study: Path,
    store: Store,
    wanted: Sequence[Job],
    missing: Sequence[Job],
    *,
    workers: int,
    listen: str | None,
    quiet: bool,
) -> None:
    """Run a batch to its end, or as far as it goes, and keep what came of it."""
    batch = launch(study, missing, workers=workers, listen=listen)
    progress = Progress(store, batch.run_dir, wanted, missing, quiet)
    try:
        summary = batch.run(progress)
    finally:
        progress.take()
    if summary["state"] == "stopped":
        raise KeyboardInterrupt
    if progress.lacking:
        raise RunFailed(
            f"{progress.lacking} of {len(missing)} repeats could not be run:"
            f" see {batch.run_dir / 'learner.log'}, then start the study again"
        )


def _outdated(store: Store, wanted: Sequence[Job]) -> set[Job]:
    """Return the jobs whose results were made by other code of their learner than ours."""
    code = {learner: code_of(learner) for learner in {job.learner for job in wanted}}
    return {job for job in wanted if job in store and store[job].code != code[job.learner]}


def _warn(old: set[Job]) -> None:
    for learner, count in Counter(job.learner for job in old).items():
        print(
            f"shearline: {count} repeats of {learner} were made by other code than this:"
            " --renew runs them again",
            file=sys.stderr,
            flush=True,
        )


def _show(text: str) -> None:
    """Put a passing line on the terminal in place of the last one; elsewhere nothing."""
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


def _cell(job: Job) -> Job:
    """Return the job's curve: the same job, whatever its seed."""
    return Job(job.function, job.placement, job.dimensions, job.learner, 0)
