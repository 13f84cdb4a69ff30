"""The launcher: ends in order whenever it is interrupted, and leaves no process behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from chaos.fleet import PATIENCE_S, processes_in

pytestmark = pytest.mark.chaos

RAISES = """
from shearline.evaluator import task

@task(space={"x": ("m", 0.0, 1.0)})
def never(theta, rng):
    raise RuntimeError("the gripper is open")
"""
DIES = """
import os, pathlib
from shearline.evaluator import task

@task(space={"x": ("m", 0.0, 1.0)})
def once(theta, rng):
    mark = pathlib.Path("died")
    if not mark.exists():
        mark.touch()
        os._exit(9)
    return theta["x"], True
"""


def up(
    folder: Path, *arguments: str, first: Callable[[], None] | None = None
) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "shearline.deploy", "up", "--out", str(folder / "run"), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        start_new_session=True,
        preexec_fn=first,  # noqa: PLW1509 - this process has no threads that matter
    )


def ended(process: subprocess.Popen[str], folder: Path) -> tuple[int, str, str]:
    """Wait for the launcher; assert that nothing it started is left."""
    out, error = process.communicate(timeout=PATIENCE_S)
    # Python may be interrupted before it has come to our first line, and says so in its own way.
    assert "Traceback" not in error or "shearline" not in error, error
    end_s = time.monotonic() + 10.0
    while left := processes_in(folder):
        assert time.monotonic() < end_s, left
        os.sched_yield()
    return process.returncode, out, error


def test_a_run_ends_with_one_json_line_that_says_everything(tmp_path: Path) -> None:
    run = up(tmp_path, "--task", "sleep-5", "--episodes", "3", "--trials", "10", "--json")
    code, out, error = ended(run, tmp_path)
    assert code == 0, error
    summary = json.loads(out.splitlines()[-1])
    assert summary["counted"] == 30
    assert [episode["trials"] for episode in summary["episodes"]] == [10, 10, 10]
    assert set(summary["recommendation"]) >= {"theta", "success_probability", "interval", "cost"}
    listed = subprocess.run(
        [sys.executable, "-m", "shearline.deploy", "trials", "run", "--json"],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    rows = [json.loads(line) for line in listed.stdout.splitlines()]
    assert [row["trial"] for row in rows] == list(range(30))


@pytest.mark.parametrize("delay_s", [0.0, 0.5, 2.0])
def test_ctrl_c_at_any_time_ends_in_order_and_the_run_goes_on_later(
    tmp_path: Path, delay_s: float
) -> None:
    asked = ["--task", "sleep-50", "--learner", "lhs", "--episodes", "3", "--trials", "40"]
    process = up(tmp_path, *asked, "--json")
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(delay_s)
    os.killpg(process.pid, signal.SIGINT)
    if not delay_s:
        # Amid Python's first imports the signal was lost once: who sees it go on presses again.
        try:
            process.wait(1.0)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGINT)
    code, _, error = ended(process, tmp_path)
    # Before Python has begun to listen, the signal itself is the answer.
    assert code in {130, -signal.SIGINT}, error
    code, out, error = ended(up(tmp_path, *asked, "--json"), tmp_path)
    assert code == 0, error
    assert json.loads(out.splitlines()[-1])["counted"] == 120


def test_a_launcher_that_is_killed_leaves_no_orphan(tmp_path: Path) -> None:
    process = up(tmp_path, "--task", "sleep-50", "--trials", "50", "--json")
    end_s = time.monotonic() + PATIENCE_S
    while len(processes_in(tmp_path)) < 3:  # launcher, learner, recorder
        assert time.monotonic() < end_s
        os.sched_yield()
    process.kill()
    assert ended(process, tmp_path)[0] == -signal.SIGKILL


def test_a_task_that_always_raises_ends_the_run_with_its_message(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(RAISES)
    code, _, error = ended(up(tmp_path, "--task", "mine.py:never", "--json"), tmp_path)
    assert code == 4
    assert "the gripper is open" in error.splitlines()[-1]


def test_an_evaluator_that_dies_is_started_again_and_said(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(DIES)
    asked = ["--task", "mine.py:once", "--episodes", "2", "--trials", "10", "--json"]
    code, out, error = ended(up(tmp_path, *asked), tmp_path)
    assert code == 0, error
    assert json.loads(out.splitlines()[-1])["counted"] == 20
    assert "started again" in error


def limited() -> None:
    """Let files grow to 1 MB only, as on a full disk; called between fork and exec."""
    import resource  # noqa: PLC0415

    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))


@pytest.mark.slow
def test_a_full_disk_for_the_record_costs_the_record_and_not_the_run(tmp_path: Path) -> None:
    asked = ["--task", "keylock", "--learner", "lhs", "--episodes", "1", "--trials", "20"]
    code, out, error = ended(up(tmp_path, *asked, "--json", first=limited), tmp_path)
    assert code == 0, error
    assert json.loads(out.splitlines()[-1])["counted"] == 20
    said = (tmp_path / "run" / "learner.out").read_text()
    assert "record" in said
