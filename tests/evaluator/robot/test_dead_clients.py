"""A client that dies, stops or hangs in a contact: what the robot makes of it."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from emulator.kit import Kind
from emulator.process import Emulator

from shearline.evaluator.robot.port import T_MAX_GRACE_S

pytestmark = pytest.mark.slow


_CLIENT = """
import sys, time, ctypes, importlib
sys.path.insert(0, {tests!r})
from emulator import kit
port = getattr(kit, {kind!r}).make({address!r}, hang_s=0.25)
port.open(kit.tool())
port.set_guard(kit.guard())
session = port.contact(kit.contact({t_max_s}))
print("running", flush=True)
{then}
"""


@contextlib.contextmanager
def client(
    kind: Kind, robot: Emulator, t_max_s: float, then: str
) -> Iterator[subprocess.Popen[str]]:
    """Run a client in a process of its own, from when its contact runs."""
    code = _CLIENT.format(
        tests=str(Path(__file__).parents[2]),
        kind=kind.name.upper(),
        address=robot.address,
        t_max_s=t_max_s,
        then=then,
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == "running"
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize(("sent", "limit_s"), [(signal.SIGKILL, 0.25), (signal.SIGSTOP, 0.1)])
def test_a_client_that_is_killed_or_frozen_is_missed_in_time(
    kind: Kind, robot: Emulator, sent: signal.Signals, limit_s: float
) -> None:
    robot.order("place")
    with client(kind, robot, 60.0, "time.sleep(60)") as process:
        robot.order("patience 0.05")
        robot.until("mode", "move")
        process.send_signal(sent)
        report = robot.until("mode", "reflex")
    assert report["noticed_s"] <= limit_s
    assert len(report["ended"]) == 1


def test_a_contact_ends_in_time_with_python_frozen(kind: Kind, robot: Emulator) -> None:
    """The FR3 by a reaction in C++; the Panda by the kernel, which ends the process."""
    robot.order("place")
    in_cpp = kind.name == "fr3"
    hold = "ctypes.PyDLL(None).usleep(60_000_000)"  # a foreign call that keeps the interpreter
    with client(kind, robot, 1.5, hold):
        if not in_cpp:
            robot.order("pace wall")  # the kernel's clock is not the robot's
        deadline = time.monotonic() + 30.0
        while not (report := robot.report())["ended"]:
            assert time.monotonic() < deadline
    (motion,) = report["ended"]
    assert motion["ended_s"] - motion["began_s"] <= 1.5 + T_MAX_GRACE_S
    assert motion["how"] == ("finished" if in_cpp else "reflex")
