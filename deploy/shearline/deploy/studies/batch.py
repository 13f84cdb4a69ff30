"""A batch: the jobs that a study lacks, as one run, and what such a run's journal holds of them.

A batch is planned once and never resumed: what it did not finish is part of the next one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import tomli_w

from shearline.deploy.launch import Launch
from shearline.deploy.studies.task import NAME, encode, repeat_of
from shearline.learner.dispatcher.entries import ResultTaken, RunOpened, TrialsProposed
from shearline.learner.run.config import from_toml
from shearline.learner.run.folder import JOURNAL
from shearline.learner.run.journal import read
from shearline.protocol.endpoints import check_endpoint, free_endpoint
from shearline.protocol.messages import OutcomeKind, Verdict
from shearline.protocol.task import TaskSpec
from shearline.studies.repeat import Job, Repeat

#: The folder of a study's runs, in the study's own.
RUNS = "runs"


def launch(study: Path, jobs: Sequence[Job], *, workers: int, listen: str | None) -> Launch:
    """Write down a run of these jobs and return it, ready to be started.

    Args:
        study: The study's folder.
        jobs: What to run, at least one, in this order.
        workers: Evaluators to start here; others may join at ``listen``.
        listen: Endpoint, or ``None`` for a free one on this machine.
    """
    run_dir = study / RUNS / f"batch-{len(folders(study)) + 1:04d}"
    run_dir.mkdir(parents=True)
    asked = {
        "task": NAME,
        "learner": "plan",
        "switches": {"tuples": [encode(job) for job in jobs]},
        "episodes": 1,
        "trials": len(jobs),
        "record": False,
        # Jobs differ in length by what learners cost; a copy of a long one would gain nothing.
        "speculative": False,
    }
    batch = run_dir / "batch.toml"
    batch.write_text(tomli_w.dumps(asked))
    return Launch(
        run_dir=run_dir,
        listen=check_endpoint(listen or free_endpoint()),
        evaluators=workers,
        task=NAME,
        learner_arguments=[str(batch), "--out", str(run_dir)],
    )


def folders(study: Path) -> list[Path]:
    """Return the folders of a study's runs, oldest first."""
    return sorted((study / RUNS).glob("batch-*"))


def harvest(run_dir: Path) -> Iterator[Repeat]:
    """Yield the repeats that a run's journal holds; the run may still be going on.

    Raises:
        RecordError: If the journal cannot be read.
    """
    if not (run_dir / JOURNAL).exists():
        return
    task: TaskSpec | None = None
    theta: dict[int, list[float]] = {}
    for entry in read(run_dir / JOURNAL):
        match entry:
            case RunOpened(config=text):
                task = from_toml(text).task
            case TrialsProposed(trials=trials):
                theta.update((planned.trial, planned.theta) for planned in trials)
            case ResultTaken(verdict=Verdict.COUNTED, result=result, evaluator=evaluator):
                if task is not None and result.kind is OutcomeKind.SUCCESS:
                    yield repeat_of(
                        task,
                        theta[result.trial],
                        result.extras,
                        run=run_dir.name,
                        trial=result.trial,
                        evaluator=evaluator,
                    )
