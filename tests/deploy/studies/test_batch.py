"""A batch's journal gives back what was run, wherever it was cut."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from shearline.deploy.studies.batch import folders, harvest, launch
from shearline.deploy.studies.task import NAME, encode
from shearline.evaluator import load_task
from shearline.learner.dispatcher.entries import Entry, ResultTaken, RunOpened, TrialsProposed
from shearline.learner.dispatcher.events import Planned
from shearline.learner.run.config import RunConfig, to_toml
from shearline.learner.run.journal import Journal
from shearline.protocol.messages import OutcomeKind, Result, Verdict
from shearline.studies.repeat import Job, Placement, jobs

JOBS = jobs(["lhs"], functions=["sphere"], dimensions=[2], seeds=range(2))


def test_a_batch_is_written_down_as_a_run_of_its_jobs(tmp_path: Path) -> None:
    batch = launch(tmp_path, JOBS, workers=3, listen=None)
    asked = tomllib.loads((batch.run_dir / "batch.toml").read_text())
    assert asked["switches"]["tuples"] == [encode(job) for job in JOBS]
    assert asked["trials"] == len(JOBS)
    assert (batch.task, batch.evaluators) == (NAME, 3)
    assert folders(tmp_path) == [batch.run_dir]


def test_each_batch_has_a_folder_of_its_own(tmp_path: Path) -> None:
    for _ in range(3):
        launch(tmp_path, JOBS[:1], workers=1, listen=None)
    assert [path.name for path in folders(tmp_path)] == ["batch-0001", "batch-0002", "batch-0003"]


def entries() -> list[Entry]:
    config = RunConfig(task=load_task(NAME).spec, learner="plan", trials=len(JOBS))
    planned = [Planned(k, encode(job), 0) for k, job in enumerate(JOBS)]
    return [
        RunOpened(at_s=0.0, run="batch-0001", config=to_toml(config)),
        TrialsProposed(at_s=0.0, episode=0, trials=planned),
        taken(2, 0.25),
        taken(0, 0.5, kind=OutcomeKind.ABORTED, verdict=Verdict.NOTED),
        taken(2, 0.25, verdict=Verdict.DUPLICATE),
        taken(1, 0.75),
    ]


def taken(
    trial: int,
    best: float,
    *,
    kind: OutcomeKind = OutcomeKind.SUCCESS,
    verdict: Verdict = Verdict.COUNTED,
) -> ResultTaken:
    return ResultTaken(
        at_s=1.0,
        evaluator="evaluator-7",
        verdict=verdict,
        result=Result(
            boot="b" * 8,
            token=f"token-{trial:08d}",
            trial=trial,
            kind=kind,
            cost=best,
            seed=0,
            extras={"best_1": best, "best_0": 2 * best, "mean_0": 9.0, "learner_s": 0.5},
        ),
    )


def test_counted_results_are_harvested_once_with_the_job_behind_them(tmp_path: Path) -> None:
    with Journal(tmp_path / "journal") as journal:
        journal.append(entries())
        found = list(harvest(tmp_path))  # while it is still written
    assert [(one.job, one.best) for one in found] == [
        (JOBS[2], [0.5, 0.25]),
        (JOBS[1], [1.5, 0.75]),
    ]
    assert JOBS[2] == Job("sphere", Placement.SHIFTED, 2, "lhs", 0)
    assert {(one.run, one.evaluator) for one in found} == {(tmp_path.name, "evaluator-7")}


@pytest.mark.parametrize("torn", range(1, 2000, 331))
def test_a_torn_journal_gives_what_was_whole(tmp_path: Path, torn: int) -> None:
    with Journal(tmp_path / "journal") as journal:
        journal.append(entries())
    data = (tmp_path / "journal").read_bytes()
    whole = list(harvest(tmp_path))
    (tmp_path / "journal").write_bytes(data[:-torn])
    found = list(harvest(tmp_path))
    assert found == whole[: len(found)]
    assert len(found) < len(whole)


def test_a_batch_that_never_began_has_nothing(tmp_path: Path) -> None:
    assert list(harvest(tmp_path)) == []
