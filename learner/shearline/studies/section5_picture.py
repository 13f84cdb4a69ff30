"""Section 5 drawn: costs trial by trial, success by episode, and the subspace of solutions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shearline.learner.interval import wilson
from shearline.studies.curves_picture import ANOTHER, LINES
from shearline.studies.experiment import SPREADS, Experiment
from shearline.studies.pictures import BLUE, GREY, INK, ORANGE, SKY, VERMILION, canvas, save, style
from shearline.studies.section5 import PAPER_SUCCESS, by_contender, fig6

#: Panels in a row of figure 6.
ACROSS = 4
#: Contenders that figure 4 does not have, and the paper's own.
MORE: dict[str, tuple[str, Any, float]] = {
    "cmaes-low": (ORANGE, (0, (1, 1)), 1.6),
    "tpe": (VERMILION, (0, (1, 1)), 1.6),
    "centre-push": (GREY, (0, (5, 1.5)), 1.6),
}
PAPER_LINES = {"PSP": BLUE, "HiREPS": VERMILION, "CMAES": ORANGE}


def draw_fig6(found: Sequence[Experiment], path: Path) -> None:
    """Draw a panel for each contender: mean cost of each trial and each episode, and the best.

    Raises:
        ConfigError: If matplotlib is not installed.
    """
    figure_class = canvas()
    curves = fig6(found)
    rows = math.ceil(len(curves) / ACROSS)
    columns = min(ACROSS, len(curves))
    with style():
        size = (1.0 + 2.2 * columns, 0.8 + 1.8 * rows)
        figure = figure_class(figsize=size, layout="constrained")
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in panels.flat[len(curves) :]:
            axes.set_visible(False)
        for axes, curve in zip(panels.flat, curves, strict=False):
            _draw_costs(axes, curve)
        panels[0, 0].legend(frameon=False, fontsize=7.0, loc="upper right")
        for row in panels:
            row[0].set_ylabel("cost [s]")
        for axes in panels[-1]:
            axes.set_xlabel("trial")
        save(figure, path)


def _draw_costs(axes: Any, curve: dict[str, Any]) -> None:
    trials = len(curve["mean_cost"])
    length = trials // len(curve["episode_cost"])
    number = np.arange(1, trials + 1)
    axes.plot(number, curve["mean_cost"], color=SKY, linewidth=0.7, label="a trial, mean")
    edges = np.arange(0, trials + 1, length)
    whole = curve["episode_cost"]
    axes.stairs(whole, edges, color=BLUE, linewidth=1.6, baseline=None, label="an episode, mean")
    best = [math.nan if value is None else value for value in curve["best_cost"]]
    axes.plot(number, best, color=INK, linewidth=1.0, linestyle="--", label="best so far, mean")
    axes.set(xlim=(0, trials), ylim=(0.0, 15.0))
    axes.set_title(f"{curve['contender']} ({curve['experiments']})")


def draw_success(found: Sequence[Experiment], path: Path) -> None:
    """Draw the share of successful trials of each episode, the paper's beside ours.

    Raises:
        ConfigError: If matplotlib is not installed.
    """
    figure_class = canvas()
    with style():
        figure = figure_class(figsize=(7.6, 3.6), layout="constrained")
        ours, paper = figure.subplots(1, 2, sharex=True, sharey=True)
        for curve in fig6(found):
            colour, dashes, width = _line(curve["contender"])
            share = 100.0 * np.array(curve["success"])
            number = np.arange(1, len(share) + 1)
            ours.plot(
                number, share, color=colour, linestyle=dashes, linewidth=width,
                label=curve["contender"],
            )  # fmt: skip
        for name, shares in PAPER_SUCCESS.items():
            paper.plot(range(1, len(shares) + 1), shares, color=PAPER_LINES[name], label=name)
        for axes, title in ((ours, "here"), (paper, "in the paper")):
            axes.set(ylim=(0, 101), xlabel="episode", title=title)
            axes.legend(frameon=False, fontsize=7.0, loc="lower right", ncols=2)
        ours.set_ylabel("successful trials [%]")
        save(figure, path)


def draw_subspace(found: Sequence[Experiment], path: Path) -> None:
    """Draw the success of draws around the recommendations over the spread of the draws.

    Raises:
        ConfigError: If matplotlib is not installed.
    """
    figure_class = canvas()
    with style():
        figure = figure_class(figsize=(5.6, 3.8), layout="constrained")
        axes = figure.subplots()
        for place, (name, mine) in enumerate(by_contender(found).items()):
            kinds = [[one.fresh for one in mine]]
            kinds += [[one.around[k] for one in mine if one.around] for k in range(len(SPREADS))]
            shares = [_share([(o.wins, o.trials) for o in kind]) for kind in kinds]
            middle, low, high = 100.0 * np.array(shares).T
            colour, dashes, width = _line(name)
            at = np.array([0.0, *SPREADS]) + 0.0006 * place
            axes.errorbar(
                at, middle, yerr=[middle - low, high - middle], color=colour, linestyle=dashes,
                linewidth=width, elinewidth=0.7, label=name,
            )  # fmt: skip
        axes.set(
            ylim=(0, 101),
            xlabel="spread of the draws around the recommendation [range of each parameter]",
            ylabel="success [%], Wilson 95 %",
        )
        axes.legend(frameon=False, fontsize=7.0, loc="lower left", ncols=2)
        save(figure, path)


def _share(counts: Sequence[tuple[int, int]]) -> tuple[float, float, float]:
    wins, trials = (sum(column) for column in zip(*counts, strict=True)) if counts else (0, 0)
    low, high = wilson(wins, trials)
    return wins / trials if trials else math.nan, low, high


def _line(name: str) -> tuple[str, Any, float]:
    return LINES.get(name) or MORE.get(name, ANOTHER)
