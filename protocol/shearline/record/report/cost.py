"""The cost of each trial by outcome, and the best so far."""

from __future__ import annotations

import numpy as np

from shearline.record.report import marks
from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup
from shearline.record.report.plot import Axis, card, legend, path, plot
from shearline.record.report.scale import Array, Scale, holding
from shearline.record.report.words import number

#: More trials than this get smaller dots.
MANY = 500


def picture(facts: Facts) -> Markup:
    """Return cost over trials."""
    table = facts.table
    title = "Cost of each trial"
    told = facts.success | facts.failure
    if not told.any():
        return card(title, note="No trial has a cost yet.")
    x = trial_axis(table["trial"])
    y = Axis(holding(table["cost"], zero=True, log=True), "cost")
    across = x.scale.place(table["trial"])
    up = y.scale.place(np.nan_to_num(table["cost"]))
    lost, fresh = facts.lost, ~facts.learning & np.isfinite(table["cost"])
    best = best_so_far(table["cost"], facts.success)
    seen = np.isfinite(best) & facts.learning
    best_line = marks.steps(across[seen], y.scale.place(best[seen]))
    refuted = fresh & ~table["success"]
    layers = [
        *_dots(facts, across, up, facts.failure, "bad"),
        path("hole", marks.dots(across[facts.failure], up[facts.failure])),
        *_dots(facts, across, up, facts.success, "ok"),
        *_dots(facts, across, up, fresh, "fresh"),
        path("hole", marks.dots(across[refuted], up[refuted])),
        path("lost", marks.uprights(across[lost], 0.0, 0.06)),
        path("best halo", best_line) if len(across) > MANY else None,
        path("best", best_line),
    ]
    entries = [("dot ok", "success"), ("dot bad ring", "failure"), ("best", "best success so far")]
    if fresh.any():
        entries.append(("dot fresh", "recommendation tried again"))
    if lost.any():
        entries.append(("lost", "lost"))
    worst = np.nanmax(table["cost"])
    about = f"{title}, {number(float(np.nanmin(table['cost'])))} to {number(float(worst))}"
    scale = " The axis is logarithmic." if y.scale.log else ""
    return card(
        title,
        plot(layers, x, y, about),
        legend(*entries),
        note=f"Lower is better.{scale}",
    )


def trial_axis(trials: np.ndarray) -> Axis:
    """Return an axis that holds all trial numbers."""
    return Axis(Scale(-1.0, float(trials.max(initial=0)) + 1.0), "trial")


def best_so_far(cost: Array, success: np.ndarray) -> Array:
    """Return the cheapest success up to each trial ``(trials,)``; ``nan`` before the first."""
    best = np.minimum.accumulate(np.where(success, cost, np.inf))
    return np.where(np.isfinite(best), best, np.nan)


def _dots(facts: Facts, x: Array, y: Array, which: np.ndarray, kind: str) -> list[Markup | None]:
    table = facts.table
    look = f"dot {kind} small" if len(x) > MANY else f"dot {kind}"
    return [
        path(look, marks.dots(x[i], y[i]), _title(table["trial"][i], table["cost"][i], why))
        for i, why in zip(np.flatnonzero(which), table["why"][which], strict=True)
    ]


def _title(trial: int, cost: float, why: str) -> str:
    return f"trial {trial}: cost {number(float(cost), 4)}" + (f", {why}" if why else "")
