"""Verifies many trials at once: fresh processes, results in order, memory bounded.

Each process loads the task once for each plant. No more than a few trials per process are under
way, so that the traces of a long run never stand in memory together.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import cache

from shearline.deploy.processes import PARENT_VARIABLE, die_with_parent
from shearline.deploy.replay.recorded import load
from shearline.evaluator.base import Task
from shearline.evaluator.replay import Case, Verification, verify
from shearline.protocol.errors import ShearlineError

#: Trials under way for each process: one runs, one waits.
AHEAD = 2


class WorkerDied(ShearlineError):  # noqa: N818 - says what happened
    """A process that ran trials is gone."""


def verify_all(name: str, cases: Iterable[Case], workers: int) -> Iterator[Verification]:
    """Yield the verification of each case, in their order.

    Args:
        name: What :func:`shearline.deploy.replay.recorded.load` is given in each process.
        cases: Each must have an outcome.
        workers: Processes, at least 1; 1 runs the trials in this one.

    Raises:
        ConfigError: If the task cannot be loaded or is another one.
        WorkerDied: If a process was killed.
    """
    if workers == 1:
        yield from (_verify(name, case) for case in cases)
        return
    pool = ProcessPoolExecutor(
        workers, multiprocessing.get_context("spawn"), _begin, (os.getpid(),)
    )
    waiting: deque[Future[Verification]] = deque()
    with pool, _ended_early():
        for case in cases:
            with _deaf():
                waiting.append(pool.submit(_verify, name, case))
            if len(waiting) >= AHEAD * workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """Let what is started meanwhile never hear Ctrl-C, from its first instruction on.

    A terminal sends it to every process; the parent hears it for all, and ends them.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _ended_early() -> Iterator[None]:
    """End the processes at once when nobody wants their results any more."""
    try:
        yield
    except BaseException as error:
        for child in multiprocessing.active_children():
            child.terminate()
        if isinstance(error, BrokenProcessPool):
            raise WorkerDied(
                "a process that ran trials was killed (short of memory?): try fewer --workers"
            ) from None
        raise


@cache
def _task(name: str, plant: str) -> Task:
    return load(name, plant)


def _verify(name: str, case: Case) -> Verification:
    return verify(_task(name, case.plant), case)


def _begin(parent: int) -> None:
    """Tie the life of this process to its parent's."""
    os.environ[PARENT_VARIABLE] = str(parent)
    die_with_parent()
