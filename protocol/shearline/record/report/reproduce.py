"""How to have the same run again: commands, versions, and everything that was asked for."""

from __future__ import annotations

import shlex
from collections import Counter
from importlib.metadata import version

from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup, tag
from shearline.record.report.plot import card
from shearline.record.report.words import count

#: Where the same run is put if it is made again.
AGAIN = "-again"


def picture(facts: Facts) -> Markup:
    """Return commands, versions and the run's configuration."""
    lines = [
        line
        for words, command in commands(facts)
        for line in (tag("span", f"# {words}\n", class_="faint"), f"{command}\n")
    ]
    return card(
        "Have it again",
        tag("pre", tag("code", *lines)),
        tag("p", "Versions: ", "; ".join(versions(facts)), "."),
        _configuration(facts),
        note="The seed decides what is proposed and every trial's noise: with the same versions a"
        " run on simulators comes out the same to the last digit, however many evaluators take"
        " part, unless trials were lost or late.",
        wide=True,
    )


def commands(facts: Facts) -> list[tuple[str, str]]:
    """Return what to type, ``(what it does, command)`` each."""
    folder = shlex.quote(str(facts.path))
    who = max(len({state.evaluator for state in facts.run.evaluators}), 1)
    again = shlex.quote(str(facts.path) + AGAIN)
    table = facts.table
    found = [
        ("the same run", f"shearline up {folder}/run.toml --evaluators {who} --out {again}"),
        ("its trials as a table", f"shearline trials {folder} --format csv"),
        ("look at it", f"shearline view {folder}"),
        ("this page", f"shearline report {folder}"),
    ]
    if facts.success.any():
        best = int(table["cost"][facts.success].argmin())
        trial = int(table["trial"][facts.success][best])
        if trial in facts.run.phases:
            own = f" --task {shlex.quote(facts.task)}" if ":" in facts.task else ""
            replay = f"shearline replay {folder} --trial {trial} --verify{own}"
            found.insert(1, ("its cheapest success, to the last bit", replay))
    return found


def versions(facts: Facts) -> list[str]:
    """Return the engines on record, and the version that wrote this page."""
    engines = Counter(str(engine) for engine in facts.table["engine"] if engine)
    ran = [f"{engine} ({count(n, 'trial')})" for engine, n in engines.most_common()]
    return [*ran, f"page by shearline {version('shearline')}"]


def _configuration(facts: Facts) -> Markup | None:
    if facts.run.config is None or not facts.run.config.text:
        return None
    text = tag("pre", tag("code", facts.run.config.text))
    return tag("details", tag("summary", "run.toml: all that was asked for"), text)
