"""Every trial of a run as a table, folded away until someone wants it."""

from __future__ import annotations

from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup, tag
from shearline.record.report.words import number

#: Rows of one page; a browser stays quick with so many.
ROWS_MAX = 5000
HEAD = ("trial", "episode", "outcome", "cost", "why", "evaluator", "attempts", "wall time [s]")


def listing(facts: Facts) -> Markup:
    """Return the table of all trials."""
    table = facts.table
    total = len(table["trial"])
    columns = [table[name][:ROWS_MAX].tolist() for name in ("trial", "episode", "outcome", "cost")]
    columns += [table[name][:ROWS_MAX].tolist() for name in ("why", "evaluator", "attempts")]
    columns.append(table["wall_s"][:ROWS_MAX].tolist())
    rows = (_row(*cells) for cells in zip(*columns, strict=True))
    more = f"; the first {ROWS_MAX} are listed" if total > ROWS_MAX else ""
    return tag(
        "details",
        tag("summary", f"Every trial ({total}{more})"),
        tag(
            "div",
            tag(
                "table",
                tag("thead", tag("tr", *(tag("th", word, scope="col") for word in HEAD))),
                tag("tbody", *rows),
                class_="sortable",
            ),
            class_="scroll",
        ),
        class_="card wide listing",
    )


def _row(
    trial: int,
    episode: int,
    outcome: str,
    cost: float,
    why: str,
    evaluator: str,
    attempts: int,
    wall_s: float,
) -> Markup:
    marks = {"success": "ok", "failure": "bad"}
    return tag(
        "tr",
        tag("td", str(trial), class_="n"),
        tag("td", str(episode + 1), class_="n"),
        tag("td", outcome, class_=f"outcome {marks.get(outcome, '')}".strip()),
        tag("td", number(cost, 4), class_="n"),
        tag("td", why),
        tag("td", evaluator),
        tag("td", str(attempts), class_="n"),
        tag("td", number(wall_s), class_="n"),
    )
