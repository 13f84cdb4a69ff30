"""Trials verified by many processes: in order, and with nothing left behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import IO

import pytest

from shearline.deploy.replay.many import AHEAD, WorkerDied, verify_all
from shearline.deploy.replay.recorded import Recorded
from shearline.evaluator.replay import Case
from shearline.record.reader import open_run

OWN = """
import os
from shearline.evaluator import task

@task(space={"x": ("m", -5.0, 5.0)})
def fatal(theta, rng):
    if os.path.exists("now"):
        os._exit(1)
    return theta["x"], True
"""

ENDLESS = """
import os, threading
from shearline.evaluator import task

@task(space={"x": ("m", -5.0, 5.0)})
def endless(theta, rng):
    if os.path.exists("now"):
        os.write(2, b"begun\\n")  # at once: two processes share the pipe
        threading.Event().wait()
    return theta["x"], True
"""


@pytest.fixture(scope="module")
def cases(sphere_run: Path) -> list[Case]:
    return list(Recorded(open_run(sphere_run)).cases())


def test_one_process_is_this_one(cases: list[Case]) -> None:
    verified = list(verify_all("sphere", cases, workers=1))
    assert [one.trial for one in verified] == [0, 1, 2, 3]
    assert all(one.identical for one in verified)


@pytest.mark.slow
def test_no_more_cases_are_taken_than_can_be_under_way(cases: list[Case]) -> None:
    taken = []

    def counted() -> Iterator[Case]:
        for case in cases * 5:
            taken.append(case)
            yield case

    verified = verify_all("sphere", counted(), workers=2)
    for done in range(1, 6):
        next(verified)
        assert len(taken) <= done + 2 * AHEAD
    assert isinstance(verified, Generator)
    verified.close()
    assert not multiprocessing.active_children()


@pytest.mark.slow
def test_a_process_that_is_killed_is_one_sentence(
    record: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "fatal_task.py").write_text(OWN)
    run = open_run(record(tmp_path / "run", "fatal_task:fatal"))
    (tmp_path / "now").touch()
    with pytest.raises(WorkerDied, match="fewer --workers"):
        list(verify_all("fatal_task:fatal", Recorded(run).cases(), workers=2))
    assert not multiprocessing.active_children()


def _until_all_closed(pipe: IO[str]) -> str:
    """Read until nobody holds the other end any more."""
    return pipe.read()


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_however_it_is_ended_no_process_stays(
    how: signal.Signals,
    record: Callable[..., Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    name = f"endless_{how.name.lower()}"
    (tmp_path / f"{name}.py").write_text(ENDLESS)
    run_dir = record(tmp_path / "run", f"{name}:endless")
    (tmp_path / "now").touch()
    command = ["replay", str(run_dir), "--all", "--verify", "--workers", "2"]
    process = subprocess.Popen(
        [sys.executable, "-m", "shearline.deploy", *command, "--task", f"{name}:endless"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    with process:
        assert process.stderr.readline() == "begun\n"
        if how is signal.SIGINT:
            os.killpg(process.pid, how)  # as a terminal does: to the whole group
        else:
            process.kill()
        # The workers, in their endless trials, hold these pipes as long as they live.
        assert _until_all_closed(process.stdout) == ""
        said = _until_all_closed(process.stderr)
    if how is signal.SIGINT:
        assert process.returncode == 130
        assert said.splitlines()[-1] == "shearline: interrupted"
        assert "Traceback" not in said
