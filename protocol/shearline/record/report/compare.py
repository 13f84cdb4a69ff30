"""Several runs side by side: did they learn equally fast, and did they find the same?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shearline.record.report import marks
from shearline.record.report.chance import wilson
from shearline.record.report.cost import best_so_far, trial_axis
from shearline.record.report.facts import Facts, gather
from shearline.record.report.failures import kinds
from shearline.record.report.headline import emblem
from shearline.record.report.health import counts
from shearline.record.report.markup import Markup, join, tag
from shearline.record.report.page import document
from shearline.record.report.plot import Axis, card, legend, path, plot
from shearline.record.report.scale import holding
from shearline.record.report.success import RATE, episode_axis
from shearline.record.report.words import NOTHING, between, duration, number, share

#: Colours of runs; they begin again after so many.
COLOURS = 8
#: Of the first table.
COLUMNS = (
    "run",
    "task",
    "learner",
    "seed",
    "trials",
    "first episode",
    "last episode",
    "recommended succeeds",
    "tried again",
    "cheapest",
    "lost",
    "wall time",
)


def compare(run_dirs: Sequence[Path | str]) -> str:
    """Return the comparison of several runs as an HTML document.

    Args:
        run_dirs: Two run folders or more; they may differ in everything.

    Raises:
        RecordError: If one of them is not there.
    """
    runs = [gather(run_dir) for run_dir in run_dirs]
    names = _names(runs)
    content = tag(
        "main",
        tag("section", tag("h2", "Runs"), _table(runs, names), _damage(runs, names)),
        tag("section", tag("h2", "Learning"), _success(runs, names), _best(runs, names)),
        tag("section", tag("h2", "Result"), _tuples(runs, names), _failures(runs, names)),
        tag("section", tag("h2", "Asked for"), _differences(runs, names)),
    )
    return document(f"{len(runs)} runs compared", _head(runs), content)


def _names(runs: Sequence[Facts]) -> list[str]:
    """Return a name for each run that no other has."""
    names = [facts.name for facts in runs]
    return [
        name if names.count(name) == 1 else f"{name} ({facts.path})"
        for name, facts in zip(names, runs, strict=True)
    ]


def _head(runs: Sequence[Facts]) -> Markup:
    tasks = sorted({facts.task for facts in runs})
    learners = sorted({facts.learner for facts in runs})
    said = (", ".join(tasks), ", ".join(learners))
    return tag(
        "header",
        emblem(),
        tag("h1", f"{len(runs)} runs compared"),
        tag("p", *(tag("span", words) for words in said), class_="facts"),
    )


def _key(i: int) -> Markup:
    return tag("i", class_=f"key dot run r{i % COLOURS}")


def _legend(names: Sequence[str]) -> Markup:
    return legend(*((f"dot run r{i % COLOURS}", name) for i, name in enumerate(names)))


def _damage(runs: Sequence[Facts], names: Sequence[str]) -> Markup | None:
    sentences = [
        f"{name}: {sentence}"
        for name, facts in zip(names, runs, strict=True)
        for sentence in facts.damage
    ]
    if not sentences:
        return None
    alarm = tag("div", join(tag("p", sentence) for sentence in sentences), class_="alarm")
    return card("Damaged records", alarm, wide=True)


def _table(runs: Sequence[Facts], names: Sequence[str]) -> Markup:
    rows = [_row(i, name, facts) for i, (name, facts) in enumerate(zip(names, runs, strict=True))]
    table = tag(
        "table",
        tag("thead", tag("tr", *(tag("th", word, scope="col") for word in COLUMNS))),
        tag("tbody", *rows),
        class_="sortable",
    )
    note = "Success rates are of the first and the last episode; intervals hold 95 %."
    return card("At a glance", tag("div", table, class_="scroll"), note=note, wide=True)


def _row(i: int, name: str, facts: Facts) -> Markup:
    advice, episodes = facts.advice, facts.episodes
    rates = [share(float(rate)) for rate in episodes.successes / episodes.trials]
    cost = facts.table["cost"]
    wall_s = float(facts.summary.get("wall_s", facts.end_s - facts.begin_s))
    numbers = (
        str(facts.settings.get("seed", NOTHING)),
        str(len(cost)),
        rates[0] if rates else NOTHING,
        rates[-1] if rates else NOTHING,
        f"{share(advice.probability)} ({between(*advice.interval)})" if advice else NOTHING,
        _tried(facts),
        number(float(cost[facts.success].min())) if facts.success.any() else NOTHING,
        str(counts(facts).get("lost", NOTHING)),
        duration(wall_s),
    )
    return tag(
        "tr",
        tag("th", _key(i), name, scope="row"),
        tag("td", facts.task),
        tag("td", facts.learner),
        *(tag("td", text, class_="n") for text in numbers),
    )


def _tried(facts: Facts) -> str:
    """Return how often the recommended tuple worked when it was tried again."""
    found = [tried for tried in facts.confirmations if tried.what == "tuple"]
    return f"{found[0].successes} of {found[0].trials}" if found else NOTHING


def _success(runs: Sequence[Facts], names: Sequence[str]) -> Markup:
    last = max((int(facts.episodes.number.max(initial=0)) for facts in runs), default=0)
    axis = episode_axis(last + 1)
    layers: list[Markup | None] = []
    for i, facts in enumerate(runs):
        episodes, kind = facts.episodes, f"run r{i % COLOURS}"
        x = axis.scale.place(episodes.number + 1.0)
        low, high = wilson(episodes.successes, episodes.trials)
        rate = episodes.successes / episodes.trials
        layers += [
            path(f"{kind} band", marks.band(x, low, high)),
            path(f"{kind} line", marks.line(x, rate), names[i]),
            path(f"{kind} dot", marks.dots(x, rate), names[i]),
        ]
    title = "Success in each episode"
    figure = plot(layers, axis, RATE, f"{title} of {', '.join(names)}")
    return card(title, figure, _legend(names), note="With 95 % intervals (Wilson).")


def _best(runs: Sequence[Facts], names: Sequence[str]) -> Markup:
    title = "Best success so far"
    bests = [best_so_far(facts.table["cost"], facts.success) for facts in runs]
    trials = np.concatenate([facts.table["trial"] for facts in runs])
    known = np.concatenate(bests)
    if not np.isfinite(known).any():
        return card(title, note="Nothing has succeeded in any of these runs.")
    x, y = trial_axis(trials), Axis(holding(known, zero=True, log=True), "cost")
    layers = []
    for i, (facts, best) in enumerate(zip(runs, bests, strict=True)):
        seen = np.isfinite(best)
        across = x.scale.place(facts.table["trial"][seen])
        data = marks.steps(across, y.scale.place(best[seen]))
        layers.append(path(f"run r{i % COLOURS} steps", data, names[i]))
    about = f"{title} of {', '.join(names)}"
    return card(title, plot(layers, x, y, about), _legend(names), note="Lower is better.")


def _tuples(runs: Sequence[Facts], names: Sequence[str]) -> Markup:
    title = "Recommended tuples"
    spaces = {tuple(facts.names) for facts in runs}
    advised = [i for i, facts in enumerate(runs) if facts.advice is not None]
    if len(spaces) > 1 or not advised:
        why = "differ in their parameters" if len(spaces) > 1 else "recommend nothing yet"
        return card(title, note=f"These runs {why}.")
    rows = [
        tag(
            "tr",
            tag("th", name, scope="row"),
            tag("td", tag("span", *_dots(runs, names, advised, k), class_="gauge"), class_="range"),
        )
        for k, name in enumerate(runs[0].names)
    ]
    note = "Each value within its run's own bounds. Where dots lie together, runs agree."
    return card(title, tag("table", tag("tbody", *rows)), _legend(names), note=note)


def _dots(
    runs: Sequence[Facts], names: Sequence[str], advised: Sequence[int], k: int
) -> Iterator[Markup]:
    for i in advised:
        advice = runs[i].advice
        assert advice is not None
        at = float(np.clip(runs[i].unit_of(advice.theta)[k], 0.0, 1.0))
        value = f"{names[i]}: {number(float(advice.theta[k]), 4)} {runs[i].units[k]}"
        yield tag("i", class_=f"dot r{i % COLOURS}", style=f"left:{100 * at:.4g}%", title=value)


def _failures(runs: Sequence[Facts], names: Sequence[str]) -> Markup:
    title = "What failed"
    found = [{kind.why: len(kind.members) for kind in kinds(facts)} for facts in runs]
    whys = sorted(
        {why for one in found for why in one}, key=lambda w: -sum(o.get(w, 0) for o in found)
    )
    if not whys:
        return card(title, note="Nothing failed in any of these runs.")
    head = tag(
        "tr", tag("th", "run", scope="col"), *(tag("th", w, scope="col", class_="n") for w in whys)
    )
    rows = (
        tag(
            "tr",
            tag("th", _key(i), names[i], scope="row"),
            *(tag("td", str(one.get(why, 0)), class_="n") for why in whys),
        )
        for i, one in enumerate(found)
    )
    table = tag("table", tag("thead", head), tag("tbody", *rows))
    return card(title, tag("div", table, class_="scroll"), note="Trials of each kind of failure.")


def _differences(runs: Sequence[Facts], names: Sequence[str]) -> Markup:
    title = "What differs"
    flat = [dict(_flat(facts.settings)) for facts in runs]
    keys = [key for key in dict.fromkeys(k for one in flat for k in one) if _differ(flat, key)]
    if not keys:
        return card(title, note="Nothing: all were asked for alike.", wide=True)
    columns = (tag("th", _key(i), name, scope="col") for i, name in enumerate(names))
    head = tag("tr", tag("th", "setting", scope="col"), *columns)
    rows = (
        tag(
            "tr",
            tag("th", key, scope="row"),
            *(tag("td", str(one.get(key, NOTHING))) for one in flat),
        )
        for key in keys
    )
    table = tag("table", tag("thead", head), tag("tbody", *rows))
    return card(title, tag("div", table, class_="scroll"), wide=True)


def _differ(flat: Sequence[Mapping[str, Any]], key: str) -> bool:
    return len({repr(one.get(key)) for one in flat}) > 1


def _flat(settings: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value
