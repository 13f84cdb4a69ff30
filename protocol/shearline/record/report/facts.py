"""What a report says about one run, gathered from its folder into arrays and plain values.

Reads the record and the run's ``summary.json``; draws nothing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from shearline.protocol.messages import Purpose
from shearline.record.reader import Run, open_run
from shearline.record.table import Table

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Advice:
    """What the learner recommends.

    Attributes:
        theta: The tuple ``(n,)`` in task units.
        probability: Estimated chance that a fresh trial of it succeeds, 0 to 1.
        interval: ``(low, high)`` of that chance with 95 % confidence.
        cost: Expected of a success, or ``None``.
        spread: Standard deviation ``(n,)`` in task units of draws from the region around the
            tuple, where bounds do not cut it: of a uniform draw from an ellipsoid in n dimensions
            the half axis over ``sqrt(n + 2)``. ``None`` without a region.
        claim: One sentence on what a draw from the region is worth, or ``""``.
    """

    theta: Array
    probability: float
    interval: tuple[float, float]
    cost: float | None
    spread: Array | None = None
    claim: str = ""


#: What is read of a confirmation.
CONFIRMED = ("claimed", "trials", "successes", "interval", "lost", "bears_out")


@dataclass(frozen=True, slots=True)
class Confirmation:
    """What fresh trials, of which the learner heard nothing, said.

    Attributes:
        what: That was tried, ``"tuple"`` or ``"region"``.
        claimed: Lower bound that the learner had claimed, 0 to 1.
        trials: With an outcome.
        successes: Among them.
        interval: 95 % of the success probability, 0 to 1.
        lost: Trials without an outcome.
        bears_out: Whether the claim is no higher than the interval.
    """

    what: str
    claimed: float
    trials: int
    successes: int
    interval: tuple[float, float]
    lost: int
    bears_out: bool


@dataclass(frozen=True, slots=True)
class Episodes:
    """Episodes as columns ``(episodes,)``; a trial belongs to the episode it was proposed in.

    Attributes:
        number: From 0.
        trials: That reached success or failure.
        successes: Among them.
    """

    number: npt.NDArray[np.int64]
    trials: npt.NDArray[np.int64]
    successes: npt.NDArray[np.int64]


@dataclass(frozen=True)
class Facts:
    """One run.

    Attributes:
        run: The record, opened.
        table: Its trials as columns.
        summary: What ``summary.json`` says; empty where the run has none.
        damage: One sentence for each damage of its files.
    """

    run: Run
    table: Table
    summary: dict[str, Any]
    damage: list[str] = field(default_factory=list)

    @property
    def path(self) -> Path:
        """The run folder."""
        return self.run.run_dir

    @cached_property
    def settings(self) -> dict[str, Any]:
        """What was asked for."""
        return self.run.settings()

    @property
    def name(self) -> str:
        """Name of the run."""
        return self.run.name or self.path.name

    @property
    def task(self) -> str:
        """Name of the task, or ``"?"``."""
        return str(self.settings.get("task", {}).get("name", "?"))

    @property
    def learner(self) -> str:
        """Name of the learner, or ``"?"``."""
        return str(self.settings.get("learner", "?"))

    @property
    def names(self) -> list[str]:
        """Parameter names."""
        return self.run.parameters

    @property
    def units(self) -> list[str]:
        """One unit for each parameter."""
        return [self.table.units.get(f"theta.{name}", "") for name in self.names]

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds ``(n,)`` in task units; what was tried, where none are known."""
        config = self.run.config
        if config is not None and config.names and len(config.low) == len(config.names):
            return np.array(config.low), np.array(config.high)
        theta = self.table.theta
        if not theta.size:
            return np.zeros(theta.shape[1]), np.ones(theta.shape[1])
        low, high = theta.min(axis=0), theta.max(axis=0)
        return low, np.where(high > low, high, low + 1.0)

    def unit_of(self, theta: npt.ArrayLike) -> Array:
        """Return tuples ``(..., n)`` in task units as shares of the bounds."""
        low, high = self.bounds
        return (np.asarray(theta, dtype=np.float64) - low) / (high - low)

    @cached_property
    def u(self) -> Array:
        """All tuples ``(trials, n)`` as shares of the bounds."""
        return self.unit_of(self.table.theta)

    @cached_property
    def learning(self) -> Mask:
        """Which trials the learner asked for ``(trials,)``; others try what it recommends."""
        asked: Mask = self.table["purpose"] == Purpose.LEARNING.value
        return asked

    @cached_property
    def success(self) -> Mask:
        """Which of the learner's trials succeeded ``(trials,)``."""
        return np.asarray(self.table["success"] & self.learning)

    @cached_property
    def failure(self) -> Mask:
        """Which of the learner's trials failed ``(trials,)``; lost ones did neither."""
        return np.asarray((self.table["outcome"] == "failure") & self.learning)

    @cached_property
    def lost(self) -> Mask:
        """Which of the learner's trials were lost ``(trials,)``."""
        return np.asarray((self.table["outcome"] == "lost") & self.learning)

    @cached_property
    def episodes(self) -> Episodes:
        """The episodes that have an outcome."""
        told = self.success | self.failure
        number, place = np.unique(self.table["episode"][told], return_inverse=True)
        won = np.bincount(place, weights=self.success[told], minlength=len(number))
        trials = np.bincount(place, minlength=len(number)).astype(np.int64)
        return Episodes(number.astype(np.int64), trials, won.astype(np.int64))

    @cached_property
    def advice(self) -> Advice | None:
        """The learner's last word, or ``None`` where it is not known."""
        said = self.summary.get("recommendation")
        return None if not said else _advice(said, self.names)

    @property
    def confirmations(self) -> list[Confirmation]:
        """What fresh trials said of the recommended tuple, then of the region around it."""
        names = (("confirmation", "tuple"), ("region_confirmation", "region"))
        return [
            Confirmation(what, **{key: said[key] for key in CONFIRMED})
            for field, what in names
            if (said := self.summary.get(field))
        ]

    def models(self) -> Iterator[dict[str, Any]]:
        """Yield the learner's models on record, the newest first."""
        for snapshot in reversed(self.run.snapshots):
            yield dict(json.loads(snapshot.model))

    @property
    def begin_s(self) -> float:
        """When the first word of the run was said [s since the epoch]."""
        return min(self._times_s, default=0.0)

    @property
    def end_s(self) -> float:
        """When the last word of the run was said [s since the epoch]."""
        return max(self._times_s, default=0.0)

    @cached_property
    def _times_s(self) -> list[float]:
        said = [state.at_s for state in self.run.evaluators]
        said += [episode.at_s for episode in self.run.episodes]
        return said + [float(at_s) for at_s in self.table["at_s"]]


def gather(run_dir: Path | str) -> Facts:
    """Read everything that a report needs.

    Raises:
        RecordError: If there is no such folder.
    """
    run = open_run(run_dir)
    damage = list(run.damage)
    path = run.run_dir / "summary.json"
    summary: dict[str, Any] = {}
    if path.is_file():
        try:
            summary = dict(json.loads(path.read_text(encoding="utf-8")))
        except (ValueError, TypeError) as error:
            damage.append(f"{path.name}: it is not JSON ({error}); it was left out")
    return Facts(run, run.table(), summary, damage)


def _advice(said: dict[str, Any], names: list[str]) -> Advice:
    low, high = said["interval"]
    region = said.get("region") or {}
    radius = region.get("radius")
    spread = None
    if radius:
        spread = np.array([radius.get(name, 0.0) for name in names]) / math.sqrt(len(names) + 2)
    return Advice(
        theta=np.array([said["theta"].get(name, np.nan) for name in names]),
        probability=float(said["success_probability"]),
        interval=(float(low), float(high)),
        cost=said["cost"],
        spread=spread,
        claim=_claim(region) if region else "",
    )


def _claim(region: dict[str, Any]) -> str:
    if "success_low" not in region:
        return ""
    return (
        f"A fresh draw from the region succeeds in at least {100 * region['success_low']:.0f} %"
        f" of trials ({100 * region['confidence']:.0f} % confidence,"
        f" {region['successes']} of {region['trials']} trials)."
    )
