"""Whether learners keep their word: what they claim for a recommendation, beside what is true.

Only a problem that knows the true chance of success of every tuple can tell. A problem is handed
in: this knows no function, no simulator and no task.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from shearline.learner import Recommendation

Array = npt.NDArray[np.float64]

#: Draws from a region over which its true success is averaged; its standard error is below .02.
DRAWS = 1000


@dataclass(frozen=True, slots=True)
class Claim:
    """What one run claims, and what is true of it; chances, 0 to 1.

    Attributes:
        low: Lower end of the interval for the recommended tuple.
        high: Its upper end.
        success: The tuple's true chance of success.
        region_low: What is claimed for the region; ``nan`` where none is stated.
        region_success: The true chance of success of a draw from it; ``nan`` likewise.
    """

    low: float
    high: float
    success: float
    region_low: float
    region_success: float


def claim_of(recommendation: Recommendation, success: Callable[[Array], Array], seed: int) -> Claim:
    """Hold a recommendation to the truth.

    Args:
        recommendation: A learner's.
        success: True chance ``(...)`` of success of tuples ``(..., n)`` in task units.
        seed: Decides the draws from the region.
    """
    low, high = recommendation.interval
    region = recommendation.region
    region_low = region_success = math.nan
    if region is not None:
        rng = np.random.default_rng(np.random.SeedSequence([seed, 0xC1A1]))
        region_low = region.success_low
        region_success = float(np.mean(success(region.sample(rng, DRAWS))))
    return Claim(low, high, float(success(recommendation.theta)), region_low, region_success)


class Coverage(msgspec.Struct, frozen=True, kw_only=True):
    """Many runs of one learner on one problem.

    Attributes:
        learner: Its name.
        problem: The problem's name.
        runs: How many runs.
        low: Mean claim for the recommended tuple.
        success: Mean true chance of success of it.
        held: Share of the runs whose interval holds the tuple's true chance.
        regions: Runs that state a region.
        region_low: Mean claim for it; ``None`` without any.
        region_success: Mean true chance of success of a draw; ``None`` without any.
        region_held: Share of those runs in which that is no less than claimed, likewise.
    """

    learner: str
    problem: str
    runs: int
    low: float
    success: float
    held: float
    regions: int
    region_low: float | None
    region_success: float | None
    region_held: float | None


def coverage(learner: str, problem: str, claims: Sequence[Claim]) -> Coverage:
    """Sum up runs, one or more, of one learner on one problem."""
    table = np.array([(c.low, c.high, c.success, c.region_low, c.region_success) for c in claims])
    low, high, success = table[:, 0], table[:, 1], table[:, 2]
    stated = table[~np.isnan(table[:, 3]), 3:]
    return Coverage(
        learner=learner,
        problem=problem,
        runs=len(claims),
        low=float(low.mean()),
        success=float(success.mean()),
        held=float(np.mean((low <= success) & (success <= high))),
        regions=len(stated),
        region_low=float(stated[:, 0].mean()) if len(stated) else None,
        region_success=float(stated[:, 1].mean()) if len(stated) else None,
        region_held=float(np.mean(stated[:, 0] <= stated[:, 1])) if len(stated) else None,
    )


def table(rows: Sequence[Coverage]) -> list[str]:
    """Return lines for people."""
    head = (
        f"{'learner':<12} {'problem':<16} {'runs':>4}"
        f" {'claimed':>8} {'true':>6} {'held':>6}   {'region':>6} {'true':>6} {'held':>6}"
    )
    return [head, *map(_line, rows)]


def _line(row: Coverage) -> str:
    region = " ".join(
        f"{'-' if value is None else format(value, kind):>6}"
        for value, kind in (
            (row.region_low, ".3f"),
            (row.region_success, ".3f"),
            (row.region_held, ".0%"),
        )
    )
    return (
        f"{row.learner:<12} {row.problem:<16} {row.runs:>4}"
        f" {row.low:>8.3f} {row.success:>6.3f} {row.held:>6.0%}   {region}"
    )
