"""Figure 4 drawn: mean best cost over evaluations, a panel for each problem, a line per learner."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from shearline.studies.curves import Curve
from shearline.studies.pictures import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    canvas,
    save,
    style,
)
from shearline.studies.repeat import EPISODE_LENGTH, Placement

#: Line of each learner: colour, dashes, width. Never two that differ by colour alone.
LINES: dict[str, tuple[str, Any, float]] = {
    "psp-ranked": (INK, "-", 2.2),
    "psp": (BLUE, "-", 2.2),
    "psp-paper": (SKY, (0, (5, 1.5)), 1.6),
    "hireps": (VERMILION, "-", 1.4),
    "ga": (GREEN, (0, (4, 1.5, 1, 1.5)), 1.6),
    "pso": (PURPLE, (0, (5, 1.5)), 1.6),
    "cmaes": (ORANGE, (0, (4, 1.5, 1, 1.5)), 1.6),
    "lhs": (GREY, (0, (1, 1)), 1.6),
    "random": (GREY, "-", 0.9),
}
#: A learner that has no line of its own yet.
ANOTHER = (INK, (0, (1, 1)), 1.2)
#: Functions on which means fall by decades.
LOGARITHMIC = {"sphere"}


def draw(found: Sequence[Curve], function: str, path: Path) -> None:
    """Draw one function: a row for each placement, a column for each number of parameters.

    Args:
        found: Curves; those of other functions are left out.
        function: Which one.
        path: The file, ``.png`` or ``.svg``.

    Raises:
        ConfigError: If matplotlib is not installed.
    """
    figure_class = canvas()
    mine = [curve for curve in found if curve.function == function]
    placements = [p for p in Placement if any(c.placement == p for c in mine)]
    dimensions = sorted({curve.dimensions for curve in mine})
    with style():
        size = (2.0 + 2.1 * len(dimensions), 1.0 + 2.1 * len(placements))
        figure = figure_class(figsize=size, layout="constrained")
        panels = figure.subplots(len(placements), len(dimensions), sharex=True, squeeze=False)
        for row, placement in zip(panels, placements, strict=True):
            for axes, n in zip(row, dimensions, strict=True):
                here = [c for c in mine if (c.placement, c.dimensions) == (placement, n)]
                _draw_panel(axes, here)
                axes.set_title(f"{n} parameters, {placement}")
            row[0].set_ylabel("best cost so far")
        for axes in panels[-1]:
            axes.set_xlabel("evaluations")
        _legend(figure, mine)
        save(figure, path)


def _draw_panel(axes: Any, here: Sequence[Curve]) -> None:
    for curve in here:
        colour, dashes, width = LINES.get(curve.learner, ANOTHER)
        low = [m - s for m, s in zip(curve.mean, curve.se, strict=True)]
        high = [m + s for m, s in zip(curve.mean, curve.se, strict=True)]
        axes.fill_between(curve.evaluations, low, high, color=colour, alpha=0.2, linewidth=0.0)
        axes.plot(curve.evaluations, curve.mean, color=colour, linestyle=dashes, linewidth=width)
    last = here[0].evaluations[-1] if here else 1
    axes.set(xlim=(0, last), xticks=[0, last // 2, last])
    for update in range(EPISODE_LENGTH, last, EPISODE_LENGTH):
        axes.axvline(update, color=GREY, linewidth=0.3, alpha=0.4, zorder=0)
    if here and here[0].function in LOGARITHMIC:
        axes.set_yscale("log")
    else:
        axes.set_ylim(bottom=0.0)


def _legend(figure: Any, mine: Sequence[Curve]) -> None:
    from matplotlib.lines import Line2D  # noqa: PLC0415 - with what draws

    names = [name for name in LINES if any(c.learner == name for c in mine)]
    names += sorted({c.learner for c in mine} - set(names))
    handles = []
    for name in names:
        colour, dashes, width = LINES.get(name, ANOTHER)
        handles.append(Line2D([], [], color=colour, linestyle=dashes, linewidth=width, label=name))
    runs = sorted({curve.runs for curve in mine})
    count = f"{runs[0]}" if len(runs) == 1 else f"{runs[0]} to {runs[-1]}"
    figure.legend(
        handles=handles,
        loc="outside right center",
        frameon=False,
        handlelength=3.2,
        title=f"mean of {count} runs\nband: ± 1 s.e.",
        title_fontsize=8.0,
        fontsize=8.5,
    )
