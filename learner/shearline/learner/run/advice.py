"""What a run recommends, as it stands in the summary: by name, in units, fit for JSON."""

from __future__ import annotations

import math
import statistics
from collections import Counter

import msgspec

from shearline.learner.base import Recommendation
from shearline.learner.confirmation import Confirmation
from shearline.learner.dispatcher.book import Book, TrialRow
from shearline.learner.dispatcher.states import TrialState
from shearline.learner.region import Region
from shearline.protocol.messages import OutcomeKind, Purpose
from shearline.protocol.space import Space

_LOST = frozenset({TrialState.LOST, TrialState.LEFT})


class RegionAdvice(msgspec.Struct, frozen=True, kw_only=True):
    """The recommended region; see :class:`shearline.learner.Region`.

    Attributes:
        centre: Its middle, in task units.
        radius: Its half axes, in task units.
        success_low: Lower bound of the chance that a trial of a draw from it succeeds.
        confidence: Of that bound.
        trials: Trials the bound rests on.
        successes: How many of them succeeded.
    """

    centre: dict[str, float]
    radius: dict[str, float]
    success_low: float
    confidence: float
    trials: int
    successes: int


class Advice(msgspec.Struct, frozen=True, kw_only=True):
    """The recommended tuple by name, and what may be expected of it; costs may be unknown."""

    theta: dict[str, float]
    success_probability: float
    interval: tuple[float, float]
    cost: float | None
    region: RegionAdvice | None


class Confirmed(msgspec.Struct, frozen=True, kw_only=True):
    """What fresh trials said; see :class:`shearline.learner.confirmation.Confirmation`.

    Attributes:
        claimed: Lower bound that the learner had claimed.
        trials: Fresh trials with an outcome.
        successes: How many of them succeeded.
        success_rate: Their share; ``None`` without trials.
        interval: Wilson interval, 95 %, of the success probability.
        lost: Fresh trials without an outcome.
        mean_cost: Mean cost of the successes; ``None`` without any.
        bears_out: Whether the claim is no higher than the interval.
        kinds: How many of the trials each kind of evaluator ran; as far as it is known.
    """

    claimed: float
    trials: int
    successes: int
    success_rate: float | None
    interval: tuple[float, float]
    lost: int
    mean_cost: float | None
    bears_out: bool
    kinds: dict[str, int]


def advice(space: Space, found: Recommendation) -> Advice:
    """Name what a learner recommends."""
    low, high = found.interval
    return Advice(
        theta=space.to_dict(found.theta),
        success_probability=float(found.success_probability),
        interval=(float(low), float(high)),
        cost=float(found.cost) if math.isfinite(found.cost) else None,
        region=None if found.region is None else _region(found.region),
    )


def confirmed(book: Book, found: Recommendation | None, purpose: Purpose) -> Confirmed | None:
    """Return what the trials of a confirmation came to so far; ``None`` where there are none."""
    claimed = None if found is None else _claimed(found, purpose)
    if claimed is None or purpose not in book.purposes:
        return None
    rows = book.rows(book.purposes.index(purpose))
    told = _confirmation(claimed, rows)
    return Confirmed(
        claimed=told.claimed,
        trials=told.trials,
        successes=told.successes,
        success_rate=told.successes / told.trials if told.trials else None,
        interval=told.interval,
        lost=told.lost,
        mean_cost=told.mean_cost,
        bears_out=told.bears_out,
        kinds=_kinds(book, rows),
    )


def _claimed(found: Recommendation, purpose: Purpose) -> float | None:
    if purpose is Purpose.CONFIRMATION:
        return float(found.interval[0])
    return None if found.region is None else found.region.success_low


def _kinds(book: Book, rows: list[TrialRow]) -> dict[str, int]:
    tokens = [row.result.token for row in rows if row.result is not None]
    return dict(Counter(kind for token in tokens if (kind := book.attempts[token].kind or "")))


def _confirmation(claimed: float, rows: list[TrialRow]) -> Confirmation:
    results = [row.result for row in rows if row.result is not None]
    costs = [result.cost for result in results if result.kind is OutcomeKind.SUCCESS]
    return Confirmation(
        claimed=claimed,
        trials=len(results),
        successes=len(costs),
        lost=sum(row.state in _LOST for row in rows),
        mean_cost=statistics.fmean(costs) if costs else None,
    )


def _region(region: Region) -> RegionAdvice:
    return RegionAdvice(
        centre=region.space.to_dict(region.centre),
        radius=region.space.to_dict(region.radius),
        success_low=region.success_low,
        confidence=region.confidence,
        trials=region.trials,
        successes=region.successes,
    )
