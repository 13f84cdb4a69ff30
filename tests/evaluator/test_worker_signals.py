"""Signals end a worker soon, whatever it runs; they need a process of their own."""

import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from evaluator.tiny_learner import WAIT_S, TinyLearner

from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.messages import (
    Bye,
    OutcomeKind,
    Renew,
    Verdict,
)

_PROCESS = """
    import os, sys
    sys.path.insert(0, sys.argv[2])
    from shearline.evaluator.tasks import load_task
    from shearline.evaluator.worker import WorkerConfig, run_worker
    end = run_worker(WorkerConfig(connect=sys.argv[1], name="lab-1"), load_task(sys.argv[3]))
    print(end.why, flush=True)
    os._exit(end.code)
"""


_BUSY = """
    from shearline.evaluator.tasks import task
    @task(space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)}, trial_s=600.0)
    def busy(theta, rng):
        while True:
            pass
"""


@contextmanager
def process(endpoint: str, folder: Path, task: str) -> Iterator[subprocess.Popen[str]]:
    (folder / "busy.py").write_text(textwrap.dedent(_BUSY))
    command = [sys.executable, "-c", textwrap.dedent(_PROCESS), endpoint, str(folder), task]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as child:
        yield child
        child.kill()


@pytest.mark.parametrize("task", ["sleep-60000", "busy:busy"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_process_soon_whatever_runs(
    learner: TinyLearner, tmp_path: Path, task: str, number: signal.Signals
) -> None:
    with process(learner.endpoint, tmp_path, task) as child:
        hello = learner.ready()
        learner.give(hello, 1, [1.0, 0.0], deadline_s=600.0)
        learner.next(Renew)
        child.send_signal(number)
        if task != "busy:busy":
            assert learner.take(Verdict.NOTED).kind is OutcomeKind.ABORTED
        assert learner.next(Bye).why == f"interrupted by {number.name}"
        assert child.wait(WAIT_S) == 130


def test_a_second_signal_ends_the_process_at_once(learner: TinyLearner, tmp_path: Path) -> None:
    with process(learner.endpoint, tmp_path, "busy:busy") as child:
        hello = learner.ready()
        learner.give(hello, 1, [1.0, 0.0], deadline_s=600.0)
        learner.next(Renew)
        learner.link.close()  # nobody takes the worker's leave
        child.send_signal(signal.SIGINT)
        child.send_signal(signal.SIGTERM)
        assert child.wait(WAIT_S) == 130


def test_a_signal_ends_the_wait_for_a_learner(tmp_path: Path) -> None:
    with process(free_endpoint(), tmp_path, "sleep-1") as child:
        while not _catches(child.pid, signal.SIGTERM):
            pass
        child.send_signal(signal.SIGTERM)
        assert child.wait(WAIT_S) == 130


def _catches(pid: int, number: signal.Signals) -> bool:
    """Tell from the kernel whether a process has a handler for a signal."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    caught = next(line for line in status.splitlines() if line.startswith("SigCgt"))
    return bool(int(caught.split()[1], 16) >> (number - 1) & 1)
