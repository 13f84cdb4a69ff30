"""Tables of words: aligned for people at a terminal, or as Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines whose columns stand under each other, the first to the left."""
    table = [head, *rows]
    widths = [max(len(row[column]) for row in table) for column in range(len(head))]
    return [
        "  ".join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in table
    ]


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the same as Markdown, the first column as code where it names a contender."""
    lines = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for first, *rest in rows:
        name = first if " " in first else f"`{first}`"
        lines.append(f"| {' | '.join([name, *rest])} |")
    return lines


def mean_se(values: Sequence[float]) -> tuple[float, float]:
    """Return mean and standard error of the values that are numbers; ``nan`` where unknown."""
    known = np.array([value for value in values if math.isfinite(value)])
    if not len(known):
        return math.nan, math.nan
    spread = float(known.std(ddof=1)) / math.sqrt(len(known)) if len(known) > 1 else math.nan
    return float(known.mean()), spread


def percent(values: Sequence[float]) -> str:
    """Write shares as their mean and its standard error in percent, e.g. ``"87.5 ± 1.2"``."""
    mean, se = mean_se(values)
    return "-" if math.isnan(mean) else f"{100 * mean:.1f}" + _error(100 * se, 1)


def seconds(values: Sequence[float]) -> str:
    """Write costs as their mean and its standard error, e.g. ``"0.512 ± 0.013"``."""
    mean, se = mean_se(values)
    return "-" if math.isnan(mean) else f"{mean:.3f}" + _error(se, 3)


def _error(se: float, digits: int) -> str:
    return "" if math.isnan(se) else f" ± {se:.{digits}f}"
