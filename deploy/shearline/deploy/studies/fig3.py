"""Figure 3: PSP on the paper's two peaks, as they are printed and as they were probably meant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from shearline.protocol.space import Space
from shearline.sims.functions import Array, Problem, two_peaks, two_peaks_narrow
from shearline.studies.peaks import Panel, watch
from shearline.studies.peaks_picture import Row

#: No reward of these problems is greater: two bells of height 1.
REWARD_MAX = 2.0
#: Switches that suit the picture: with a high price of errors, as the paper wants it, both peaks
#: stay more often. The literal reading has it already.
SWITCHES: Mapping[str, Mapping[str, object]] = MappingProxyType({"psp": {"svm_c": 1e3}})


def cost_as_printed(u: Array) -> Array:
    """Return 2 - r for the paper's equations (1) and (2)."""
    return REWARD_MAX - two_peaks(u)


def cost_narrow(u: Array) -> Array:
    """Return 2 - r for bells narrow enough to leave two peaks."""
    return REWARD_MAX - two_peaks_narrow(u)


@dataclass(frozen=True, slots=True)
class Peaks:
    """One problem of the figure.

    Attributes:
        problem: Its cost is 2 - r; every trial succeeds.
        title: For the picture.
        maxima: Where r is greatest, ``(2,)`` each; for the narrow bells to within 1e-4.
    """

    problem: Problem
    title: str
    maxima: Sequence[tuple[float, float]]


PROBLEMS = (
    Peaks(
        Problem("as printed", Space.unit(2), cost_as_printed),
        "Equations (1) and (2) as printed: the bells merge, there is one maximum, 1.765",
        [(0.5, 0.5)],
    ),
    Peaks(
        Problem("narrow", Space.unit(2), cost_narrow),
        "The same with bells of width 0.2: two maxima, 1.000 each",
        [(0.25, 0.25), (0.75, 0.75)],
    ),
)


@dataclass(frozen=True, slots=True)
class Found:
    """One problem's runs.

    Attributes:
        peaks: The problem.
        panels: Of the first seed, which is drawn.
        runs: Number of seeds.
        kept: How many of them hold every maximum in the accepted region after the last episode.
        kept_any: How many hold at least one.
        best: Greatest reward found by each seed ``(runs,)``.
    """

    peaks: Peaks
    panels: list[Panel]
    runs: int
    kept: int
    kept_any: int
    best: list[float]

    def row(self) -> Row:
        """Return what is drawn of it."""
        peaks = self.peaks
        return Row(peaks.title, peaks.problem.cost, peaks.maxima, self.panels)

    def data(self) -> dict[str, Any]:
        """Return the figure's data as plain values."""
        return {
            "problem": self.peaks.problem.name,
            "maxima": [list(at) for at in self.peaks.maxima],
            "runs": self.runs,
            "kept": self.kept,
            "kept_any": self.kept_any,
            "best_reward": self.best,
            "panels": [self._panel(panel) for panel in self.panels],
        }

    def _panel(self, panel: Panel) -> dict[str, Any]:
        return {
            "episode": panel.episode,
            "accepted": panel.accepted,
            "regions": panel.regions,
            "holds": [panel.holds(at) for at in self.peaks.maxima],
            "best_reward": REWARD_MAX - panel.best_cost,
            "samples": panel.u.tolist(),
            "good": panel.good.tolist(),
            "fresh": panel.fresh.tolist(),
            "means": panel.means.tolist(),
            "covariances": panel.covariances.tolist(),
        }


def find(peaks: Peaks, learner: str, seeds: range) -> Found:
    """Run a learner on one problem from each seed.

    Args:
        peaks: The problem.
        learner: ``psp`` or ``psp-paper``.
        seeds: At least one; the first is drawn.

    Raises:
        ConfigError: If the learner's snapshot cannot be drawn.
    """
    runs = [watch(peaks.problem, seed, learner, SWITCHES.get(learner, {})) for seed in seeds]
    held = np.array([[run[-1].holds(at) for at in peaks.maxima] for run in runs])
    return Found(
        peaks=peaks,
        panels=runs[0],
        runs=len(runs),
        kept=int(held.all(axis=1).sum()),
        kept_any=int(held.any(axis=1).sum()),
        best=[REWARD_MAX - run[-1].best_cost for run in runs],
    )
