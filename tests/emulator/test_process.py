"""The robot's process: obeys, and never outlives whoever started it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from emulator.process import TESTS, Emulator
from emulator.wire import FR3

pytestmark = pytest.mark.slow

_PARENT = """
import sys, time
from pathlib import Path
from emulator.process import Emulator
robot = Emulator(10, Path(sys.argv[1]))
print(robot.child.process.pid, flush=True)
time.sleep(60)
"""


def test_it_starts_at_rest_in_front_of_the_lock_and_nobody_has_moved_it(tmp_path: Path) -> None:
    with Emulator(FR3.version, tmp_path / "log") as robot:
        report = robot.report()
        assert report["mode"] == "idle"
        assert report["moves"] == 0
        assert report["travel_m"] == 0.0
        assert report["depth_m"] == pytest.approx(-0.015)


def test_its_clock_runs_while_nobody_is_connected(tmp_path: Path) -> None:
    with Emulator(FR3.version, tmp_path / "log") as robot:
        before = robot.report()["t_s"]
        deadline = time.monotonic() + 10.0
        while robot.report()["t_s"] < before + 0.05:
            assert time.monotonic() < deadline


def test_the_lock_stands_elsewhere_in_another_trial(tmp_path: Path) -> None:
    with Emulator(FR3.version, tmp_path / "log") as robot:
        depths = {robot.order(f"place {seed}")["depth_m"] for seed in (1, 2, 1)}
    assert len(depths) == 2


def test_it_dies_with_whoever_started_it(tmp_path: Path) -> None:
    command = [sys.executable, "-c", _PARENT, str(tmp_path / "log")]
    environment = os.environ | {"PYTHONPATH": str(TESTS)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.send_signal(signal.SIGKILL)
    deadline = time.monotonic() + 10.0
    while _lives(pid):
        assert time.monotonic() < deadline, "an orphan"
        time.sleep(0.01)


def _lives(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False
