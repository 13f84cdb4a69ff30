"""Real processes: evaluators killed and stopped, the learner killed, every trial counted once."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from shearline.learner.dispatcher import Book
from shearline.learner.dispatcher.entries import AttemptIssued, LearnerBooted, ResultTaken
from shearline.learner.run.journal import read
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import RecordError

LEARNER = """
import os, sys
from pathlib import Path
from shearline.learner.run.config import RunConfig
from shearline.learner.run.serving import serve
from shearline.protocol.task import TaskSpec

task = TaskSpec(name="t", space={"x": ("", -1.0, 1.0)})
config = RunConfig(task=task, learner="random", episodes=3, trials=60, record=False)
summary = serve(config, Path(sys.argv[1]), sys.argv[2])
os._exit(0 if summary.state == "complete" else 4)
"""

EVALUATOR = """
import os, sys, time
from shearline.evaluator.base import Outcome
from shearline.evaluator.worker import WorkerConfig, run_worker
from shearline.protocol.task import TaskSpec

class Slow:
    spec = TaskSpec(name="t", space={"x": ("", -1.0, 1.0)})
    engine = "slow"
    def warm(self):
        pass
    def run(self, theta, seed, beat):
        end_s = time.monotonic() + 0.05
        while time.monotonic() < end_s:
            beat()
            time.sleep(0.005)
        return Outcome(cost=float(theta[0] ** 2), success=True)

end = run_worker(WorkerConfig(connect=sys.argv[1], name=sys.argv[2], kind="function"), Slow())
os._exit(end.code)
"""


@contextlib.contextmanager
def process(program: str, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """Have a Python process run while the block lasts, at the longest."""
    command = [sys.executable, "-c", program, *arguments]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as running:
        try:
            yield running
        finally:
            running.kill()


def counted(folder: Path) -> int:
    """Return how many trials are counted by now."""
    try:
        return Book.of(read(folder / "journal")).tally.counted
    except RecordError:
        return 0


def wait_for(condition: Callable[[], bool], limit_s: float = 30.0) -> None:
    """Wait until something is so, looking often."""
    end_s = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end_s, "waited too long"
        time.sleep(0.02)


@pytest.mark.chaos
def test_kills_and_stops_cost_no_trial_and_nothing_acknowledged(tmp_path: Path) -> None:
    folder, endpoint = tmp_path / "run", free_endpoint()
    with (
        process(EVALUATOR, endpoint, "killed") as killed,
        process(EVALUATOR, endpoint, "stopped") as stopped,
        process(EVALUATOR, endpoint, "steady") as steady,
    ):
        with process(LEARNER, str(folder), endpoint) as learner:
            wait_for(lambda: counted(folder) > 20)
            killed.kill()
            wait_for(lambda: counted(folder) > 40)
            stopped.send_signal(signal.SIGSTOP)
            wait_for(lambda: counted(folder) > 50)
            learner.kill()
        before = [e for e in read(folder / "journal") if isinstance(e, ResultTaken)]
        with process(LEARNER, str(folder), endpoint) as learner:
            wait_for(lambda: counted(folder) > 120)
            stopped.send_signal(signal.SIGCONT)
            assert learner.wait(30.0) == 0
        assert steady.wait(10.0) == stopped.wait(10.0) == 0
    entries = list(read(folder / "journal"))
    book = Book.of(entries)
    assert (book.tally.counted, book.tally.lost, book.epoch) == (180, 0, 2)
    assert [e for e in entries if isinstance(e, ResultTaken)][: len(before)] == before
    booted_s = [e.at_s for e in entries if isinstance(e, LearnerBooted)][1]
    issued_s = [e.at_s for e in entries if isinstance(e, AttemptIssued) and e.at_s > booted_s]
    assert min(issued_s) - booted_s < 2.0
