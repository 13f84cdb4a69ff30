"""``shearline trials`` and ``shearline view``: look at a run folder."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_connect, add_json


def register(commands: Subparsers) -> None:
    """Add the commands."""
    trials = commands.add_parser("trials", help="list the trials of a run")
    trials.add_argument("run", metavar="RUN_DIR", type=Path)
    add_json(trials)
    trials.set_defaults(handler=list_trials)

    view = commands.add_parser("view", help="open a run in Rerun")
    view.add_argument("run", metavar="RUN_DIR", type=Path, nargs="?")
    view.add_argument("--live", action="store_true", help="attach to the run that is going on")
    view.add_argument("--save", metavar="FILE.rrd", type=Path, help="write a file, open no window")
    add_connect(view)
    view.set_defaults(handler=view_run)


def list_trials(arguments: argparse.Namespace) -> int:
    """Print one line per trial: JSON objects, or columns for people."""
    from shearline.record.reader import open as open_run  # noqa: PLC0415 - mcap loads on use

    rows = open_run(arguments.run).trial_rows()
    if arguments.json:
        for row in rows:
            print(json.dumps(row))
        return Exit.OK
    print(f"{'trial':>5} {'episode':>7} {'outcome':<8} {'cost':>8} {'attempts':>8}  evaluator")
    for row in rows:
        print(
            f"{row['trial']:>5} {row['episode']:>7} {row['outcome']:<8} {row['cost']:>8.3f}"
            f" {row['attempts']:>8}  {row['evaluator']}"
        )
    return Exit.OK


def view_run(arguments: argparse.Namespace) -> int:
    """Open the run in Rerun's viewer, or write what it would show to a file."""
    raise NotImplementedError
