"""The end of a run in words: how it went, what it recommends, and how to look at it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from shearline.deploy.table import duration, number

#: Things that should be nothing; only those that happened are said.
TROUBLES = ("lost", "duplicates", "late", "aborted", "rejected")


def print_summary(summary: Mapping[str, Any], run_dir: Path, units: Mapping[str, str]) -> None:
    """Print a run's summary for people.

    Args:
        summary: What ``summary.json`` holds.
        run_dir: The run folder.
        units: Unit of each parameter.
    """
    console = Console()
    console.print(_episodes(summary))
    troubles = [f"{summary[name]} {name}" for name in TROUBLES if summary[name]]
    console.print(
        f"\n{summary['counted']} trials counted in {duration(summary['wall_s'])} min"
        + (f" ({', '.join(troubles)})" if troubles else ", none lost")
    )
    if summary.get("recommendation"):
        console.print(_recommendation(summary["recommendation"], units))
    console.print("\nlook at it   ", f"shearline view {run_dir}", soft_wrap=True)
    console.print("its trials   ", f"shearline trials {run_dir} --json", soft_wrap=True)


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


def _recommendation(said: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    low, high = said["interval"]
    table = Table(
        title=f"\nrecommended: succeeds with probability {said['success_probability']:.2f}"
        f" (95 % interval {low:.2f} to {high:.2f}), cost about {number(said['cost'])}",
        title_justify="left",
        box=None,
        padding=(0, 2),
        show_header=False,
    )
    columns = 3
    cells = [f"{name} {value:.4g} {units.get(name, '')}" for name, value in said["theta"].items()]
    for start in range(0, len(cells), columns):
        table.add_row(*cells[start : start + columns])
    return table
