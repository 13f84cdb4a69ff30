"""The top of the page: what run this is, and the five figures that are asked for first."""

from __future__ import annotations

import datetime as dt

import numpy as np

from shearline.record.report.chance import wilson
from shearline.record.report.facts import Facts
from shearline.record.report.health import TROUBLES, counts
from shearline.record.report.markup import Markup, join, tag
from shearline.record.report.words import NOTHING, between, count, duration, number, share


def headline(facts: Facts) -> Markup:
    """Return the head of a run's page."""
    said = [facts.task, facts.learner, f"seed {facts.settings.get('seed', NOTHING)}", _state(facts)]
    if facts.begin_s:
        begun = dt.datetime.fromtimestamp(facts.begin_s, tz=dt.UTC)
        said.append(f"{begun:%Y-%m-%d %H:%M} UTC")
    return tag(
        "header",
        emblem(),
        tag("h1", facts.name),
        tag("p", *(tag("span", words) for words in said), class_="facts"),
        tag("div", *_tiles(facts), class_="tiles"),
    )


def emblem() -> Markup:
    """Return the mark of the project: five pins parted at one line."""
    lengths = (30, 16, 38, 22, 33)
    pins = "".join(f"M{8 + 14 * i} {44 - h}v{h - 3}" for i, h in enumerate(lengths))
    keys = "".join(f"M{8 + 14 * i} 50v{44 - h}" for i, h in enumerate(lengths))
    return tag(
        "svg",
        tag("path", class_="pins", d=pins),
        tag("path", class_="keys", d=keys),
        tag("path", class_="shear", d="M0 47H72"),
        viewBox="0 0 72 92",
        class_="emblem",
        aria_hidden="true",
    )


def _state(facts: Facts) -> str:
    state = str(facts.summary.get("state", ""))
    if state:
        return state if state == "complete" else f"{state}: {facts.summary.get('why', '')}"
    return "not ended"


def _tiles(facts: Facts) -> list[Markup]:
    table = facts.table
    return [
        _last_episode(facts),
        _advised(facts),
        _tile(
            number(float(table["cost"][facts.success].min())) if facts.success.any() else NOTHING,
            "cheapest success",
            _which(facts),
        ),
        _tile(
            str(len(table["trial"])),
            "trials",
            f"{int(facts.success.sum())} succeeded, {int(facts.failure.sum())} failed",
        ),
        _time(facts),
    ]


def _last_episode(facts: Facts) -> Markup:
    episodes = facts.episodes
    if not len(episodes.number):
        return _tile(NOTHING, "success in the last episode", "no trial yet")
    won, trials = int(episodes.successes[-1]), int(episodes.trials[-1])
    low, high = wilson(won, trials)
    said = f"{won} of {trials}; 95 % interval {between(float(low), float(high))}"
    return _tile(share(won / trials), "success in the last episode", said)


def _advised(facts: Facts) -> Markup:
    for tried in facts.confirmations:
        if tried.what == "tuple" and tried.trials:
            said = f"{tried.successes} of {tried.trials}; 95 % interval {between(*tried.interval)}"
            return _tile(share(tried.successes / tried.trials), "recommended, tried again", said)
    advice = facts.advice
    if advice is None:
        return _tile(NOTHING, "recommended tuple", "none on record")
    said = f"95 % interval {between(*advice.interval)}"
    return _tile(share(advice.probability), "recommended tuple succeeds", said)


def _which(facts: Facts) -> str:
    if not facts.success.any():
        return "nothing has succeeded"
    table = facts.table
    rows = np.flatnonzero(facts.success)
    best = rows[int(table["cost"][rows].argmin())]
    return f"trial {table['trial'][best]}, episode {table['episode'][best] + 1}"


def _time(facts: Facts) -> Markup:
    wall_s = float(facts.summary.get("wall_s", facts.end_s - facts.begin_s))
    said = counts(facts)
    troubles = [f"{said[name]} {name}" for name in TROUBLES if said.get(name)]
    fine = "nothing lost" if said else count(len(facts.run.evaluators), "state")
    return _tile(duration(wall_s), "wall time", ", ".join(troubles) or fine)


def _tile(figure: str, label: str, said: str) -> Markup:
    return tag(
        "div",
        tag("b", figure),
        tag("span", label),
        tag("small", join([said])),
        class_="tile",
    )
