"""Every tuple that was tried, as one line through all parameters: parallel coordinates.

Parameters are rows, each from its lower to its upper bound, so that their names and units can be
read on any screen. Lines go from top to bottom, coloured by episode.
"""

from __future__ import annotations

import numpy as np

from shearline.record.report import marks
from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup, join, tag
from shearline.record.report.plot import card, legend, path, surface
from shearline.record.report.scale import Array
from shearline.record.report.words import number, quantity

#: Lines that an eye can still tell apart; of more trials some are shown, evenly spaced.
LINES_MAX = 400


def picture(facts: Facts) -> Markup:
    """Return the parallel coordinates of a run."""
    title = "Parameters of every trial"
    told = np.flatnonzero(facts.success | facts.failure)
    if not told.size or not facts.names:
        return card(title, note="No trial has been tried yet.")
    shown = thinned(told, LINES_MAX)
    failed = [i for i in shown if facts.failure[i]]
    won = [i for i in shown if facts.success[i]]
    rows = row_places(len(facts.names))
    layers = [
        path("row-line", marks.grid([], rows)),
        tag("g", *(_line(facts, i, rows, "bad") for i in failed), class_="failures"),
        tag("g", *(_line(facts, i, rows, "ok") for i in won), class_="successes"),
        *_advised(facts, rows),
    ]
    note = (
        "One line for each trial, from its first parameter to its last; the ends of a row are"
        " the bounds. Where lines gather, the learner has found what it likes."
    )
    if len(shown) < len(told):
        note += f" {len(shown)} of {len(told)} trials are drawn."
    about = f"{len(shown)} trials over {len(facts.names)} parameters"
    plane = surface(layers, about, class_="strands")
    body = tag("div", _labels(facts), plane, class_="parallel", style=f"--rows:{len(rows)}")
    return card(title, _switches(bool(failed)), body, _legend(facts), note=note, wide=True)


def thinned(indices: np.ndarray, most: int) -> list[int]:
    """Return at most so many of the indices, evenly spaced, the first and last among them."""
    if len(indices) <= most:
        return [int(i) for i in indices]
    kept = np.round(np.linspace(0, len(indices) - 1, most)).astype(int)
    return [int(i) for i in indices[kept]]


def row_places(n: int) -> Array:
    """Return the heights ``(n,)`` of the rows' middles, 0 to 1, the first row on top."""
    return 1.0 - (np.arange(n) + 0.5) / n


def _line(facts: Facts, i: int, rows: Array, kind: str) -> Markup | None:
    table = facts.table
    last = max(int(facts.episodes.number[-1]), 1)
    late = round(100 * int(table["episode"][i]) / last)
    title = (
        f"trial {table['trial'][i]}, episode {table['episode'][i] + 1}: {table['outcome'][i]},"
        f" cost {number(float(table['cost'][i]), 4)}"
    )
    data = marks.line(np.clip(facts.u[i], 0.0, 1.0), rows)
    return path(f"strand {kind}", data, title, style=f"--late-share:{late}%")


def _advised(facts: Facts, rows: Array) -> list[Markup | None]:
    """Return the region as an area from row to row, and the recommended tuple on top."""
    advice = facts.advice
    if advice is None:
        return []
    u = np.clip(facts.unit_of(advice.theta), 0.0, 1.0)
    return [
        path("advised halo", marks.line(u, rows)),
        path("advised", marks.line(u, rows), "the recommended tuple"),
        path("advised dot", marks.dots(u, rows)),
    ]


def _labels(facts: Facts) -> Markup:
    low, high = facts.bounds
    rows = zip(facts.names, facts.units, low, high, strict=True)
    return tag(
        "div",
        *(
            tag(
                "div",
                tag("b", name),
                tag("small", f"{number(float(lo))} to {quantity(float(hi), unit)}"),
            )
            for name, unit, lo, hi in rows
        ),
        class_="parallel-names",
    )


def _switches(failed: bool) -> Markup:  # noqa: FBT001 - whether there is anything to switch
    switches = [("hide-ok", "successes"), *([("hide-bad", "failures")] if failed else [])]
    return join(
        tag(
            "label",
            tag("input", type="checkbox", class_=kind, checked=True),
            f" {words}",
            class_="switch",
        )
        for kind, words in switches
    )


def _legend(facts: Facts) -> Markup:
    entries = [("early", "early episode"), ("late", "late episode"), ("faint", "failure")]
    if facts.advice is not None:
        entries.append(("advised", "recommended"))
    return legend(*entries)
