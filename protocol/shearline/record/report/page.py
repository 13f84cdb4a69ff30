"""The page: one HTML file that needs nothing else, and the report of one run on it.

Style and script stand in the page; its own policy forbids it any request. What the pictures show
is theirs to know.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from shearline.record.report import (
    cost,
    durations,
    evaluators,
    failures,
    health,
    importance,
    parameters,
    recommendation,
    reproduce,
    slices,
    success,
)
from shearline.record.report.facts import Facts, gather
from shearline.record.report.headline import headline
from shearline.record.report.listing import listing
from shearline.record.report.markup import Child, Markup, tag

#: The page may style itself and run its own script, and load nothing from anywhere.
POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"


def report(run_dir: Path | str) -> str:
    """Return the report of one run as an HTML document.

    Args:
        run_dir: The run folder; a damaged record is read up to its damage, and the page says so.

    Raises:
        RecordError: If there is no such folder.
    """
    facts = gather(run_dir)
    return document(f"{facts.name}: {facts.task}, {facts.learner}", headline(facts), body(facts))


def body(facts: Facts) -> Markup:
    """Return the pictures of one run in the order in which people ask."""
    found = importance.of_run(facts)
    return tag(
        "main",
        _section("Learning", success.picture(facts), cost.picture(facts)),
        _section("Result", recommendation.picture(facts), importance.picture(facts, found)),
        _section("Search", parameters.picture(facts), slices.picture(facts, found)),
        _section("Trials", failures.picture(facts), durations.picture(facts)),
        _section("Machinery", evaluators.picture(facts), health.picture(facts)),
        _section("Again", reproduce.picture(facts), listing(facts)),
    )


def document(title: str, *content: Child) -> str:
    """Return a whole document around some content."""
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", name="color-scheme", content="light dark"),
        tag("title", title),
        tag("style", _asset("style.css")),
    )
    script = tag("script", _asset("script.js"))
    footer = tag("footer", "Made by Shearline from the run's own record. Nothing was loaded.")
    whole = tag("html", head, tag("body", *content, footer, script), lang="en")
    return f"<!doctype html>\n{whole}\n"


def _section(title: str, *pictures: Child) -> Markup:
    return tag("section", tag("h2", title), *pictures)


def _asset(name: str) -> Markup:
    return Markup(files(__package__).joinpath(name).read_text(encoding="utf-8"))
