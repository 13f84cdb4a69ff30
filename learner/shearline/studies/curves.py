"""Means over seeds: what a learner's repeats on one problem amount to, and their table."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import msgspec
import numpy as np

from shearline.studies.repeat import EVERY, Placement, Repeat

#: Means below this are written with an exponent.
SMALL = 0.01
DECIMALS_MAX = 4


class Curve(msgspec.Struct, frozen=True, kw_only=True):
    """One learner on one problem over its seeds.

    Attributes:
        runs: Number of seeds, m.
        evaluations: Trials behind each point ``(points,)``.
        mean: Mean over the seeds of the least cost so far ``(points,)``.
        se: Standard errors of those means ``(points,)``; 0 for a single run.
        episode_mean: Mean over the seeds of each episode's mean cost ``(episodes,)``.
        learner_s: Mean processor time of one run spent in the learner [s].
    """

    function: str
    placement: Placement
    dimensions: int
    learner: str
    runs: int
    evaluations: list[int]
    mean: list[float]
    se: list[float]
    episode_mean: list[float]
    learner_s: float

    @property
    def final(self) -> str:
        """The last point as text: mean ± standard error."""
        return with_error(self.mean[-1], self.se[-1])


def curves(repeats: Iterable[Repeat]) -> list[Curve]:
    """Return a curve for each learner on each problem, in the order in which they first come.

    Repeats of one curve need not stand side by side.
    """
    cells: dict[tuple[str, Placement, int, str], list[Repeat]] = {}
    for one in repeats:
        job = one.job
        key = (job.function, job.placement, job.dimensions, job.learner)
        cells.setdefault(key, []).append(one)
    return [_curve(cell) for cell in cells.values()]


@dataclass(frozen=True, slots=True)
class Block:
    """One table: a function and a placement, a row for each learner.

    Attributes:
        title: Function and placement.
        dimensions: Of the columns, rising.
        rows: Learner to its curve in each column, ``None`` where there is none.
    """

    title: str
    dimensions: list[int]
    rows: dict[str, list[Curve | None]]


def blocks(found: Iterable[Curve]) -> list[Block]:
    """Return the tables that curves fill, the learners in the order in which they first come."""
    cells = {(c.function, c.placement, c.learner, c.dimensions): c for c in found}
    return [
        Block(
            title=f"{function}, {placement}",
            dimensions=(ns := sorted({k[3] for k in cells if k[:2] == (function, placement)})),
            rows={
                learner: [cells.get((function, placement, learner, n)) for n in ns]
                for learner in dict.fromkeys(k[2] for k in cells if k[:2] == (function, placement))
            },
        )
        for function, placement in dict.fromkeys(key[:2] for key in cells)
    ]


def table(found: Iterable[Curve]) -> list[str]:
    """Return lines for people at a terminal: mean, standard error and number of runs."""
    lines: list[str] = []
    for block in blocks(found):
        lines += ["", f"{block.title}: mean best cost ± standard error (runs)"]
        lines.append(_line("", [f"{n} parameters" for n in block.dimensions]))
        for learner, row in block.rows.items():
            cells = [f"{curve.final} ({curve.runs})" if curve else "-" for curve in row]
            lines.append(_line(learner, cells))
    return lines[1:]


def markdown(found: Iterable[Curve]) -> list[str]:
    """Return the same as Markdown, the least mean of each column in bold."""
    lines: list[str] = []
    for block in blocks(found):
        columns = [f"{n}" for n in block.dimensions]
        lines += [
            "",
            f"| {block.title} | {' | '.join(columns)} |",
            "| --- " * (1 + len(columns)) + "|",
        ]
        least = [
            min(curve.mean[-1] for curve in column if curve is not None)
            for column in zip(*block.rows.values(), strict=True)
        ]
        for learner, row in block.rows.items():
            cells = [_bold(curve, low) for curve, low in zip(row, least, strict=True)]
            lines.append(f"| `{learner}` | {' | '.join(cells)} |")
    return lines[1:]


def _line(head: str, cells: Iterable[str]) -> str:
    return f"{head:12}" + "".join(f"{cell:>22}" for cell in cells)


def _bold(curve: Curve | None, least: float) -> str:
    if curve is None:
        return "-"
    return f"**{curve.final}**" if curve.mean[-1] == least else curve.final


def with_error(mean: float, se: float) -> str:
    """Write a mean and its standard error, the error with two digits.

    Example:
        >>> with_error(4.8873, 0.2816), with_error(162.4, 6.2), with_error(0.00031, 0.00004)
        ('4.89 ± 0.28', '162.4 ± 6.2', '(3.1 ± 0.4)e-4')
    """
    if 0.0 < mean < SMALL:
        exponent = math.floor(math.log10(mean))
        scale = 10.0**exponent
        return f"({mean / scale:.1f} ± {se / scale:.1f})e{exponent}"
    digits = 2 if se <= 0.0 else min(max(1 - math.floor(math.log10(se)), 0), DECIMALS_MAX)
    return f"{mean:.{digits}f} ± {se:.{digits}f}"


def _curve(cell: list[Repeat]) -> Curve:
    job, runs = cell[0].job, len(cell)
    best = np.array([one.best for one in cell])
    se = best.std(axis=0, ddof=1) / np.sqrt(runs) if runs > 1 else np.zeros(best.shape[1])
    return Curve(
        function=job.function,
        placement=job.placement,
        dimensions=job.dimensions,
        learner=job.learner,
        runs=runs,
        evaluations=[EVERY * (i + 1) for i in range(best.shape[1])],
        mean=best.mean(axis=0).tolist(),
        se=se.tolist(),
        episode_mean=np.mean([one.mean for one in cell], axis=0).tolist(),
        learner_s=float(np.mean([one.learner_s for one in cell])),
    )
