"""Children are named, logged, ended in bounded time, and never outlive their parent."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from shearline.deploy.processes import end, spawn, wait

SLEEP = ["-c", "import time; print('up', flush=True); time.sleep(60)"]
DEAF_CODE = """
import signal, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
print('up', flush=True)
time.sleep(60)
"""
DEAF = ["-c", DEAF_CODE]
PARENT_CODE = """
import sys, time
from pathlib import Path
from shearline.deploy.processes import spawn
spawn('child', ['-c', sys.argv[1]], Path(sys.argv[2]))
time.sleep(60)
"""
CHILD_CODE = """
from shearline.deploy.processes import die_with_parent
die_with_parent()
import os, time
print(os.getpid(), flush=True)
time.sleep(60)
"""


def until(condition: object, patience_s: float = 10.0) -> None:
    """Spin until a condition holds; the bound only decides when to give up."""
    assert callable(condition)
    end_s = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < end_s, "gave up waiting"
        os.sched_yield()


def is_gone(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return True
    return state == "Z"


def test_what_a_child_says_is_in_its_log(tmp_path: Path) -> None:
    child = spawn("talker", ["-c", "print('one'); print('two')"], tmp_path / "talker.log")
    assert wait([child], patience_s=10.0)
    assert child.returncode == 0
    assert child.last_words() == "two"


@pytest.mark.parametrize("program", [SLEEP, DEAF], ids=["polite", "deaf"])
def test_a_child_is_ended_even_if_it_ignores_being_asked(
    program: list[str], tmp_path: Path
) -> None:
    child = spawn("sleeper", program, tmp_path / "sleeper.log")
    until(lambda: child.last_words() == "up")
    end([child], patience_s=0.2)
    assert child.returncode in {-signal.SIGTERM, -signal.SIGKILL}


def test_a_frozen_child_is_ended(tmp_path: Path) -> None:
    child = spawn("frozen", DEAF, tmp_path / "frozen.log")
    until(lambda: child.last_words() == "up")
    child.process.send_signal(signal.SIGSTOP)
    end([child], patience_s=0.2)
    assert child.returncode == -signal.SIGKILL


def test_a_child_dies_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    log = tmp_path / "child.log"
    parent = subprocess.Popen([sys.executable, "-c", PARENT_CODE, CHILD_CODE, str(log)])
    until(lambda: log.exists() and log.read_text().strip())
    pid = int(log.read_text())
    parent.kill()
    parent.wait()
    until(lambda: is_gone(pid))
