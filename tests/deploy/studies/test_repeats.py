"""A study runs what is missing and nothing else, whatever became of the process before."""

from __future__ import annotations

import contextlib
import json
import signal
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from shearline.deploy.launch import RunFailed
from shearline.deploy.studies import repeats
from shearline.deploy.studies.batch import folders
from shearline.deploy.studies.repeats import RESULTS, Progress, gather
from shearline.deploy.studies.task import problem
from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Status
from shearline.studies.benchmark import run_learner
from shearline.studies.provenance import code_of
from shearline.studies.repeat import Job, Placement, Repeat, jobs
from shearline.studies.store import Store


def some(count: int, learner: str = "lhs") -> list[Job]:
    return jobs(
        [learner],
        functions=["sphere"],
        placements=[Placement.SHIFTED],
        dimensions=[2],
        seeds=range(count),
    )


def made(job: Job, code: str | None = None) -> Repeat:
    return Repeat(
        job=job,
        best=[1.0] * 40,
        mean=[1.0] * 10,
        learner_s=0.0,
        versions={},
        code=code_of(job.learner) if code is None else code,
        run="batch-0000",
        trial=job.seed,
        evaluator="evaluator-0",
    )


STATUS = Status(
    run="batch-0001", task="repeat", learner="plan", epoch=1, state="running", episode=0,
    episodes=1, trials_per_episode=3, pending=1, leased=1, done=1, counted=1, lost=0, late=0,
    duplicates=0, aborted=0, rejected=0, rate_hz=0.5, step_ms_max=0.0, evaluators=[], history=[],
    at_s=0.0,
)  # fmt: skip


def test_what_is_there_is_not_run_again(tmp_path: Path) -> None:
    with Store(tmp_path / RESULTS) as store:
        store.add([made(job) for job in some(3)])
    assert gather(tmp_path, some(2), workers=0) == [made(job) for job in some(2)]
    assert not folders(tmp_path)


def test_results_of_other_code_are_used_but_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Store(tmp_path / RESULTS) as store:
        store.add([made(job, "older") for job in some(2)])
    assert len(gather(tmp_path, some(2), workers=0)) == 2
    assert "2 repeats of lhs" in capsys.readouterr().err


@pytest.mark.slow
def test_evaluators_share_the_work_and_only_what_is_missing_is_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Store(tmp_path / RESULTS) as store:
        store.add([made(some(3)[1])])
    found = gather(tmp_path, some(3), workers=2)
    assert [one.job for one in found] == some(3)
    assert found[1] == made(some(3)[1])
    for one in (found[0], found[2]):
        alone = run_learner(
            "lhs", problem(one.job), episodes=10, episode_length=40, seed=one.job.seed
        )
        assert one.best == alone.best_every(10).tolist()
    (run_dir,) = folders(tmp_path)
    summary = json.loads((run_dir / "summary.json").read_text())
    assert (summary["counted"], summary["state"]) == (2, "complete")
    assert "2 parameters, lhs: best" in capsys.readouterr().out


@pytest.mark.slow
def test_renewing_replaces_what_other_code_made(tmp_path: Path) -> None:
    with Store(tmp_path / RESULTS) as store:
        store.add([made(some(2)[0], "older"), made(some(2)[1])])
    found = gather(tmp_path, some(2), workers=1, renew=True, quiet=True)
    assert found[0].code == code_of("lhs")
    assert found[0].run == "batch-0001"
    assert found[1] == made(some(2)[1])


def test_a_terminal_shows_how_far_a_batch_is_and_a_pipe_does_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with Store(tmp_path / RESULTS) as store:
        progress = Progress(store, tmp_path, some(3), some(3), quiet=False)
        progress.update(STATUS)
        assert capsys.readouterr().err == ""
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
        progress.update(STATUS)
        assert "1 of 3 repeats, 0.50/s, 0:04 left" in capsys.readouterr().err
        assert progress.lacking == 3


class Lossy:
    """A batch whose run ends with a trial lost."""

    def __init__(self, run_dir: Path) -> None:
        self.run_dir = run_dir

    def run(self, show: object) -> dict[str, str]:
        del show
        return {"state": "complete"}


def test_a_repeat_that_was_lost_is_said_and_the_others_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Store(tmp_path / RESULTS) as store:
        store.add([made(some(1)[0])])
    monkeypatch.setattr(repeats, "launch", lambda study, *_, **__: Lossy(study / "runs"))
    with pytest.raises(RunFailed, match="2 of 2 repeats"):
        gather(tmp_path, some(3), workers=1)
    with Store(tmp_path / RESULTS) as store:
        assert list(store) == [made(some(1)[0])]


@pytest.mark.slow
def test_a_job_that_no_run_can_carry_ends_the_study_in_one_sentence(tmp_path: Path) -> None:
    nowhere = msgspec.structs.replace(some(1)[0], dimensions=0)
    with pytest.raises(RunFailed, match="tuple 0 of the plan is out of bounds"):
        gather(tmp_path, [nowhere], workers=0)


#: A journal of this size holds results [bytes].
SOME_BYTES = 20_000

STUDY = [
    sys.executable, "-m", "shearline.deploy", "study", "fig4", "--learners", "lhs", "psp",
    "--functions", "sphere", "--dimensions", "2", "--experiments", "4", "--workers", "1",
    "--no-picture", "--json", "--out",
]  # fmt: skip


@pytest.mark.chaos
@pytest.mark.slow
def test_a_study_killed_and_started_again_runs_no_finished_repeat_twice(tmp_path: Path) -> None:
    results = tmp_path / RESULTS
    with subprocess.Popen([*STUDY, str(tmp_path)], stdout=subprocess.PIPE) as first:
        while first.poll() is None and not any(
            path.stat().st_size > SOME_BYTES for path in tmp_path.glob("runs/*/journal")
        ):
            with contextlib.suppress(subprocess.TimeoutExpired):
                first.wait(0.01)
        first.send_signal(signal.SIGKILL)
    kept = results.read_bytes().splitlines() if results.exists() else []
    done = subprocess.run([*STUDY, str(tmp_path)], capture_output=True, check=True, timeout=120)
    curves = json.loads(done.stdout)["curves"]
    assert [curve["runs"] for curve in curves] == [4, 4, 4, 4]
    lines = results.read_bytes().splitlines()
    assert lines[: len(kept)] == kept
    found = [msgspec.json.decode(line, type=Repeat) for line in lines]
    assert len({one.job for one in found}) == len(found) == 16


def test_a_second_study_in_the_same_folder_is_refused(tmp_path: Path) -> None:
    with Store(tmp_path / RESULTS), pytest.raises(RecordError, match="another study"):
        gather(tmp_path, some(1), workers=0)
