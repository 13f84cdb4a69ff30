"""Figure 3 drawn: samples, labels, decision region and proposal, one panel for each episode."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shearline.studies.peaks import GRID, Array, Panel, grid
from shearline.studies.pictures import BLUE, GREY, INK, VERMILION, canvas, save, style

REJECTED = "#CDD9E5"
#: Lines of equal cost behind the samples.
LEVELS = 7


@dataclass(frozen=True, slots=True)
class Row:
    """One problem's panels.

    Attributes:
        title: What the problem is.
        cost: Its cost at tuples ``(..., 2)``.
        maxima: Where the reward is greatest, ``(2,)`` each.
        panels: One for each episode.
    """

    title: str
    cost: Callable[[Array], Array]
    maxima: Sequence[tuple[float, float]]
    panels: Sequence[Panel]


def draw(rows: Sequence[Row], caption: str, path: Path) -> None:
    """Draw the rows one below the other.

    Args:
        rows: At least one, with equally many panels.
        caption: One line below the picture: learner, switches, seed.
        path: The file, ``.png`` or ``.svg``.

    Raises:
        ConfigError: If matplotlib is not installed.
    """
    figure_class = canvas()
    with style():
        figure = figure_class(figsize=(9.2, 2.62 * len(rows) + 0.9), layout="constrained")
        parts = figure.subfigures(len(rows) + 1, 1, height_ratios=[*[1.0] * len(rows), 0.24])
        for row, part in zip(rows, parts[:-1], strict=True):
            part.suptitle(row.title, x=0.01, ha="left", fontsize=9.5, fontweight="bold")
            all_axes = part.subplots(1, len(row.panels), sharex=True, sharey=True)
            for panel, axes in zip(row.panels, all_axes, strict=True):
                _draw_panel(axes, row, panel)
            all_axes[0].set_ylabel("y")
        _legend(parts[-1], caption)
        save(figure, path)


def _draw_panel(axes: Any, row: Row, panel: Panel) -> None:
    _draw_region(axes, panel.decision, row.cost(grid()).reshape(GRID, GRID))
    for mean, covariance in zip(panel.means, panel.covariances, strict=True):
        axes.plot(*_ellipse(mean, covariance), color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
    for good, colour, marker in ((False, VERMILION, "x"), (True, BLUE, "o")):
        for fresh, size, alpha in ((False, 9, 0.45), (True, 20, 1.0)):
            at = panel.u[(panel.good == good) & (panel.fresh == fresh)]
            axes.scatter(*at.T, s=size, c=colour, marker=marker, alpha=alpha, lw=0.9, zorder=3)
    axes.scatter(*np.array(row.maxima).T, s=90, marker="+", c="k", linewidths=1.6, zorder=4)
    axes.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", xticks=[0, 0.5, 1], yticks=[0, 0.5, 1])
    axes.set_xlabel("x")
    axes.set_title(
        f"episode {panel.episode + 1}: {panel.accepted:.0%} accepted,"
        f" {panel.regions} region{'s' if panel.regions != 1 else ''}",
        fontsize=8.0,
    )


def _draw_region(axes: Any, decision: Array, cost: Array) -> None:
    """Shade what the filter rejects, and draw lines of equal cost over it."""
    axis = np.linspace(0.0, 1.0, GRID)
    accepted = decision >= 0.0
    axes.contourf(axis, axis, accepted, levels=[-0.5, 0.5, 1.5], colors=[REJECTED, "w"])
    if accepted.any() and not accepted.all():  # else there is no border to draw
        axes.contour(axis, axis, decision, levels=[0.0], colors=[INK], linewidths=0.9)
    axes.contour(axis, axis, cost, levels=LEVELS, colors=[GREY], linewidths=0.4, alpha=0.6)


def _ellipse(mean: Array, covariance: Array) -> tuple[Array, Array]:
    """Return the line at two standard deviations around a Gaussian, as x and y."""
    values, vectors = np.linalg.eigh(covariance)
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    x, y = mean[:, None] + 2.0 * vectors @ (np.sqrt(values)[:, None] * circle)
    return x, y


def _legend(part: Any, caption: str) -> None:
    from matplotlib.lines import Line2D  # noqa: PLC0415 - with what draws
    from matplotlib.patches import Patch  # noqa: PLC0415

    def dot(marker: str, colour: str, size: float, alpha: float, label: str) -> Any:
        return Line2D(
            [], [], linestyle="", marker=marker, color=colour, ms=size, alpha=alpha, label=label
        )

    part.legend(
        handles=[
            dot("o", BLUE, 5, 1.0, "good, of this episode"),
            dot("o", BLUE, 3, 0.45, "good, of earlier ones"),
            dot("x", VERMILION, 5, 1.0, "bad, of this episode"),
            dot("x", VERMILION, 3, 0.45, "bad, of earlier ones"),
            Patch(facecolor="w", edgecolor=INK, label="accepted by the filter"),
            Patch(facecolor=REJECTED, edgecolor="none", label="rejected"),
            Line2D([], [], color=INK, linestyle=(0, (4, 2)), label="next proposals, 2 s.d."),
            dot("+", "k", 8, 1.0, "maximum of the reward"),
        ],
        loc="upper center",
        ncols=4,
        frameon=False,
        fontsize=8.0,
    )
    part.text(0.5, 0.0, caption, ha="center", va="bottom", fontsize=8.0, color=GREY)
