"""An evaluator whose trial hangs while a file exists: its threads live on, its loop does not beat.

Run as ``python hanging.py ENDPOINT NAME TASK FILE``.
"""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from shearline.deploy.processes import die_with_parent
from shearline.evaluator.base import Array, Outcome
from shearline.evaluator.builtin import builtin_task
from shearline.evaluator.worker import WorkerConfig, run_worker


class Hanging:
    """A built-in task that stops beating while a file exists."""

    def __init__(self, name: str, file: Path) -> None:
        self._task = builtin_task(name)
        self._file = file
        self.spec = self._task.spec
        self.engine = self._task.engine

    def warm(self) -> None:
        """Warm what is inside."""
        self._task.warm()

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
        """Hang, then run."""
        while self._file.exists():
            time.sleep(0.01)
        return self._task.run(theta, seed, beat)


if __name__ == "__main__":
    die_with_parent()
    logging.basicConfig(level=logging.INFO)
    endpoint, name, task, file = sys.argv[1:]
    os._exit(run_worker(WorkerConfig(endpoint, name=name), Hanging(task, Path(file))).code)
