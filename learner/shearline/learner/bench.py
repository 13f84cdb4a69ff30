"""What a learner itself costs: the time and memory of one update and the proposals of an episode.

Measured on data that has a boundary to learn, clean and with flipped labels, for labels that
contradict each other are what makes a support vector machine expensive. Time is processor time of
all threads, so that a busy machine does not matter; each row has a process of its own, so that its
peak of memory is its own.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import msgspec
import numpy as np

from shearline.learner.base import Array, Learner, Proposal
from shearline.learner.registry import create, resolve
from shearline.protocol.space import Space

#: The key-in-lock has 23 parameters.
PARAMETERS = 23
#: Proposals asked for after the update, one episode of the paper's benchmarks.
PROPOSALS = 40
SIZES = (200, 1_000, 10_000, 100_000)
FLIPPED = 0.1


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """One measurement.

    Attributes:
        learner: Its name.
        trials: Trials it has been told.
        flipped: Share of them whose success was flipped.
        tell_s: Processor time of all tells together [s].
        ask_s: Processor time of the update and ``PROPOSALS`` proposals [s].
        recommend_s: Processor time of a recommendation [s].
        memory_mb: Most memory beyond what a learner that was told ``PROPOSALS`` trials needs,
            all trials among it [MB].
    """

    learner: str
    trials: int
    flipped: float
    tell_s: float
    ask_s: float
    recommend_s: float
    memory_mb: float


def measure(
    learner: str = "psp", sizes: Iterable[int] = SIZES, flipped: Iterable[float] = (0.0, FLIPPED)
) -> Iterator[Row]:
    """Yield a row for each size and share, in order, as it is measured.

    Args:
        learner: Name of the learner.
        sizes: Numbers of trials, each at least ``PROPOSALS``.
        flipped: Shares of trials whose success is flipped.

    Raises:
        UnknownLearnerError: If no learner has that name.
    """
    name = resolve(learner)
    wanted = [(size, share) for size in sizes for share in flipped]
    return (_apart(name, size, share) for size, share in wanted)


def _apart(name: str, trials: int, flipped: float) -> Row:
    # A fresh interpreter, not a fork: what this process has touched is not the learner's.
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_row, name, trials, flipped).result()


def _row(name: str, trials: int, flipped: float) -> Row:
    _times(name, PROPOSALS, 0.0)  # imports and touches everything that every row needs
    before_mb = _peak_mb()
    tell_s, ask_s, recommend_s = _times(name, trials, flipped)
    return Row(
        learner=name,
        trials=trials,
        flipped=flipped,
        tell_s=tell_s,
        ask_s=ask_s,
        recommend_s=recommend_s,
        memory_mb=_peak_mb() - before_mb,
    )


def _times(name: str, trials: int, flipped: float) -> tuple[float, float, float]:
    """Return what telling, updating with proposals, and recommending took [s]."""
    learner = create(name, Space.unit(PARAMETERS), PROPOSALS, seed=1)
    rng = np.random.default_rng([trials, int(100 * flipped)])
    # All are asked for before any is told: what is measured is the one update that sees them all.
    proposals = learner.ask(trials)
    began = time.process_time()
    _tell(learner, proposals, flipped, rng)
    told = time.process_time()
    learner.ask(PROPOSALS)
    asked = time.process_time()
    learner.recommend()
    return told - began, asked - told, time.process_time() - asked


def _peak_mb() -> float:
    """Return the most memory this program has had [MB].

    Not ``ru_maxrss``: a new program begins with that of the process it was started from.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    (peak,) = (line for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(peak.split()[1]) * 1024 / 1e6


def _tell(
    learner: Learner, proposals: list[Proposal], flipped: float, rng: np.random.Generator
) -> None:
    """Let about half of the trials succeed: a ball in the first six parameters."""
    for proposal in proposals:
        distance = _distance(proposal.theta)
        success = (distance < 0.7) != (rng.random() < flipped)
        cost = 0.3 + distance if success else 14.8
        learner.tell(proposal.trial, cost=cost, success=bool(success))


def _distance(u: Array) -> float:
    return float(np.linalg.norm(u[:6] - 0.5))
