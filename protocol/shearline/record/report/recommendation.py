"""The recommended tuple: what may be expected of it, and where each value lies in its range."""

from __future__ import annotations

import numpy as np

from shearline.protocol.messages import Purpose
from shearline.record.report.facts import Advice, Confirmation, Facts
from shearline.record.report.markup import Markup, tag
from shearline.record.report.plot import card
from shearline.record.report.words import between, count, number, quantity, share


def picture(facts: Facts) -> Markup:
    """Return the recommendation of a run, or a sentence on why there is none."""
    title = "Recommended"
    advice = facts.advice
    if advice is None:
        return card(
            title,
            note="There is none on record: the run has not ended, or nothing has succeeded."
            " A run goes on with the same command and its folder.",
        )
    tried = (_confirmation(facts, confirmation) for confirmation in facts.confirmations)
    return card(title, _promise(advice), *tried, _table(facts, advice), note=_note(advice))


def promise(advice: Advice) -> str:
    """Return what may be expected of a fresh trial, in words."""
    return (
        f"succeeds with probability {advice.probability:.2f}"
        f" (95 % interval {between(*advice.interval)}), cost about {number(advice.cost)}"
    )


def _promise(advice: Advice) -> Markup:
    low, high = (100 * end for end in advice.interval)
    gauge = tag(
        "span",
        tag("i", class_="region", style=f"left:{low:.4g}%;width:{high - low:.4g}%"),
        tag("i", class_="dot", style=f"left:{100 * advice.probability:.4g}%"),
        class_="gauge",
        title=f"{share(advice.probability)}, 95 % interval {between(*advice.interval)}",
    )
    return tag("p", "A fresh trial ", promise(advice), ".", gauge, class_="promise")


def _confirmation(facts: Facts, tried: Confirmation) -> Markup:
    what = "It was" if tried.what == "tuple" else "Draws from its region were"
    verdict = "borne out" if tried.bears_out else "not borne out"
    purpose = Purpose.CONFIRMATION if tried.what == "tuple" else Purpose.REGION
    table = facts.table
    chosen = table["purpose"] == purpose.value
    kinds = " and ".join(f"{kind}s" for kind in np.unique(table["evaluator_kind"][chosen]) if kind)
    words = (
        f"{what} tried {count(tried.trials, 'time')} on fresh noise{kinds and f', on {kinds}'}:"
        f" {tried.successes} succeeded"
        f" (95 % interval {between(*tried.interval)});"
        f" the claim of at least {share(tried.claimed)} is {verdict}."
    )
    bad = table["trial"][chosen & ~table["success"]].tolist()
    if bad:
        words += f" Failed: {', '.join(f'trial {trial}' for trial in bad[:5])}"
        words += f" and {len(bad) - 5} more." if len(bad) > 5 else "."
    return tag("p", words, class_="tried" if tried.bears_out else "tried trouble")


def _note(advice: Advice) -> str:
    if advice.spread is None:
        return "No region around this tuple is on record."
    return (
        "The band is one standard deviation either way of a draw from the region around the tuple. "
        + advice.claim
    ).strip()


def _table(facts: Facts, advice: Advice) -> Markup:
    low, high = facts.bounds
    u = facts.unit_of(advice.theta)
    reach = np.zeros(len(u)) if advice.spread is None else advice.spread / (high - low)
    head = ["parameter", "value", "in its range", *([] if advice.spread is None else ["region"])]
    rows = [_row(facts, advice, u[i], float(reach[i]), i) for i in range(len(u))]
    return tag(
        "table",
        tag("thead", tag("tr", *(tag("th", word, scope="col") for word in head))),
        tag("tbody", *rows),
        class_="recommended",
    )


def _row(facts: Facts, advice: Advice, u: float, reach: float, i: int) -> Markup:
    low, high = (float(bound[i]) for bound in facts.bounds)
    unit = facts.units[i]
    value = float(advice.theta[i])
    spread = None if advice.spread is None else f"± {number(float(advice.spread[i]), 2)}"
    return tag(
        "tr",
        tag("th", facts.names[i], scope="row"),
        tag("td", quantity(value, unit, 4), class_="n"),
        tag(
            "td",
            in_range(u, reach),
            class_="range",
            title=f"{number(low)} to {quantity(high, unit)}",
        ),
        tag("td", spread, class_="n faint") if spread else None,
    )


def in_range(u: float, reach: float = 0.0) -> Markup:
    """Return a bar for a range with a dot at ``u``, 0 to 1, and a band of ``reach`` around it."""
    if not np.isfinite(u):
        return tag("span", class_="gauge")
    at = min(max(u, 0.0), 1.0)
    low, high = max(at - reach, 0.0), min(at + reach, 1.0)
    band = tag("i", class_="region", style=f"left:{100 * low:.4g}%;width:{100 * (high - low):.4g}%")
    dot = tag("i", class_="dot", style=f"left:{100 * at:.4g}%")
    return tag("span", band if reach else None, dot, class_="gauge")
