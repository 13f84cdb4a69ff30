"""The end of a run in words: how it went, what it recommends, and how to look at it."""

from __future__ import annotations

import math
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from shearline.deploy.table import duration, number

#: What each confirmation tried, by its name in the summary.
CONFIRMATIONS = {
    "confirmation": "the recommended tuple",
    "region_confirmation": "tuples drawn from the region",
}

#: Columns of a page that is not a terminal.
PIPE_COLUMNS = 110
#: Things that should be nothing; only those that happened are said.
TROUBLES = {
    "lost": "lost",
    "duplicates": "duplicate results ignored",
    "late": "late",
    "aborted": "attempts aborted",
    "rejected": "attempts rejected",
}


def print_summary(summary: Mapping[str, Any], run_dir: Path, units: Mapping[str, str]) -> None:
    """Print a run's summary for people.

    Args:
        summary: What ``summary.json`` holds.
        run_dir: The run folder.
        units: Unit of each parameter.
    """
    # A pipe has no width of its own; a table must not break there.
    console = Console(width=None if sys.stdout.isatty() else PIPE_COLUMNS)
    console.print(_episodes(summary))
    troubles = [f"{summary[name]} {text}" for name, text in TROUBLES.items() if summary[name]]
    console.print(
        f"\n{summary['counted']} trials counted in {duration(summary['wall_s'])} min"
        + (f" ({', '.join(troubles)})" if troubles else ", each once")
    )
    if summary["state"] != "complete":
        console.print(f"stopped: {summary['why']}; the same command with --out {run_dir} goes on")
    if summary.get("recommendation"):
        console.print(_recommendation(summary["recommendation"]))
        console.print(_tuple(summary["recommendation"], units))
    for text in confirmations(summary):
        console.print(f"\n{text}")
    console.print(f"\nread about it        {_ourselves()} report {run_dir}", soft_wrap=True)
    console.print(f"look at it in Rerun  {_ourselves()} view {run_dir}", soft_wrap=True)
    console.print(f"run a trial again    {_ourselves()} replay {run_dir} --trial 0", soft_wrap=True)
    console.print(f"list its trials      {_ourselves()} trials {run_dir} --json", soft_wrap=True)


def confirmations(summary: Mapping[str, Any]) -> list[str]:
    """Say what fresh trials came to, beside what was claimed: a text for each confirmation."""
    return [
        _confirmation(summary[name], tried)
        for name, tried in CONFIRMATIONS.items()
        if summary.get(name)
    ]


def _ourselves() -> str:
    """Return what a person here types to run this program."""
    return "shearline" if shutil.which("shearline") else sys.argv[0]


def _episodes(summary: Mapping[str, Any]) -> Table:
    table = Table(
        title=f"{summary['task']}, {summary['learner']}, seed {summary['seed']}",
        title_justify="left",
        box=None,
        padding=(0, 2),
    )
    for name in ("episode", "trials", "success", "mean cost", "best cost"):
        table.add_column(name, justify="right")
    for episode in summary["episodes"]:
        table.add_row(
            str(episode["episode"] + 1),
            str(episode["trials"]),
            f"{episode['success_rate']:.0%}",
            number(episode["mean_cost"]),
            number(episode["best_cost"]),
        )
    return table


def _recommendation(said: Mapping[str, Any]) -> str:
    low, high = said["interval"]
    text = (
        f"\nrecommended: succeeds with probability {said['success_probability']:.2f}"
        f" ({low:.2f} to {high:.2f} at 95 %), cost about {number(said['cost'])}"
    )
    region = said.get("region")
    if region:
        text += (
            "\nthe region around it, as wide as said behind ± (one standard deviation):"
            f" draws succeed with at least {region['success_low']:.2f}"
        )
    return text


def _tuple(said: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    table = Table(box=None, padding=(0, 2), show_header=False)
    columns = 3
    cells = [
        f"{name} {value:.4g}{_spread(said.get('region'), name)} {units.get(name, '')}"
        for name, value in said["theta"].items()
    ]
    for start in range(0, len(cells), columns):
        table.add_row(*cells[start : start + columns])
    return table


def _spread(region: Mapping[str, Any] | None, name: str) -> str:
    """Return one parameter's standard deviation over the region, where bounds do not cut it."""
    if region is None:
        return ""
    radius: Mapping[str, float] = region["radius"]
    return f" ± {radius[name] / math.sqrt(len(radius) + 2):.2g}"


def _confirmation(said: Mapping[str, Any], tried: str) -> str:
    low, high = said["interval"]
    lost = f", {said['lost']} lost" if said["lost"] else ""
    where = _on(said.get("kinds", {})) + lost
    verdict = "which bears out" if said["bears_out"] else "which does NOT bear out"
    return (
        f"confirmed: {tried} succeeded in {said['successes']} of {said['trials']} fresh trials"
        f"{where}: {low:.2f} to {high:.2f} at 95 %,\n{verdict} the claim of at least"
        f" {said['claimed']:.2f}; mean cost {number(said['mean_cost'])}"
    )


def _on(kinds: Mapping[str, int]) -> str:
    """Say which kinds of evaluators ran trials, and how many each where there are several."""
    if len(kinds) == 1:
        return "".join(f" on {kind}s" for kind in kinds)
    counts = ", ".join(f"{trials} on {kind}s" for kind, trials in sorted(kinds.items()))
    return f" ({counts})" if counts else ""
