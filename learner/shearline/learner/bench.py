"""What a learner itself costs: the time of one update and the proposals of one episode.

Measured on data that has a boundary to learn, clean and with flipped labels, for labels that
contradict each other are what makes a support vector machine expensive.
"""

from __future__ import annotations

import time
from collections.abc import Iterable

import numpy as np

from shearline.learner.base import Array, Learner, Proposal
from shearline.learner.registry import create
from shearline.protocol.space import Space

#: The key-in-lock has 23 parameters.
PARAMETERS = 23
#: Proposals asked for after the update, one episode of the paper's benchmarks.
PROPOSALS = 40
FLIPPED = 0.1


def measure(
    sizes: Iterable[int] = (200, 1_000, 10_000),
    learner: str = "psp",
    flipped: Iterable[float] = (0.0, FLIPPED),
) -> list[dict[str, float | int | str]]:
    """Time update and proposals of a learner that has seen so many trials.

    Args:
        sizes: Numbers of trials, each a multiple of ``PROPOSALS``.
        learner: Name of the learner.
        flipped: Shares of trials whose success is flipped.

    Returns:
        One row for each size and share: ``learner``, ``trials``, ``flipped``, ``tell_s`` (all
        tells together), ``ask_s`` (update and ``PROPOSALS`` proposals), ``recommend_s``.
    """
    _warm(learner)
    return [_row(learner, size, share) for size in sizes for share in flipped]


def _warm(learner: str) -> None:
    """Import and touch everything, so that the first row costs what the others do."""
    _row(learner, PROPOSALS, 0.0)


def _row(name: str, trials: int, flipped: float) -> dict[str, float | int | str]:
    # One long episode, so that all trials are drawn before the update that is measured.
    learner = create(name, Space.unit(PARAMETERS), trials, seed=1)
    rng = np.random.default_rng([trials, int(100 * flipped)])
    proposals = learner.ask(trials)
    began = time.perf_counter()
    _tell(learner, proposals, flipped, rng)
    told = time.perf_counter()
    learner.ask(PROPOSALS)
    asked = time.perf_counter()
    learner.recommend()
    return {
        "learner": name,
        "trials": trials,
        "flipped": flipped,
        "tell_s": told - began,
        "ask_s": asked - told,
        "recommend_s": time.perf_counter() - asked,
    }


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
