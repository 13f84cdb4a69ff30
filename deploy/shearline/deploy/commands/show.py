"""``shearline trials`` and ``shearline view``: look at a run folder."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_connect, add_json
from shearline.protocol.errors import ConfigError


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
    from shearline.record.reader import open_run  # noqa: PLC0415 - mcap loads on use

    run = open_run(arguments.run)
    for sentence in run.damage:
        print(f"shearline: {sentence}", file=sys.stderr)
    if arguments.json:
        for row in run.trials():
            print(json.dumps(row))
        return Exit.OK
    print(
        f"{'trial':>5} {'episode':>7}  {'outcome':<8} {'cost':>9} {'attempts':>8}  evaluator, why"
    )
    for row in run.trials():
        cost = "-" if row["cost"] is None else f"{row['cost']:.4g}"
        print(
            f"{row['trial']:>5} {row['episode'] + 1:>7}  {row['outcome']:<8} {cost:>9}"
            f" {row['attempts']:>8}  {row['evaluator']} {row['why']}"
        )
    return Exit.OK


def view_run(arguments: argparse.Namespace) -> int:
    """Open the run in Rerun's viewer, or write what it would show to a file."""
    from shearline.record import view  # noqa: PLC0415 - loads rerun

    if arguments.live:
        view.view_live(arguments.connect, arguments.run)
        return Exit.OK
    if arguments.run is None:
        raise ConfigError("which run? give its folder, or --live for the one that is going on")
    run = view.save(arguments.run, arguments.save) if arguments.save else view.view(arguments.run)
    for sentence in run.damage:
        print(f"shearline: {sentence}", file=sys.stderr)
    return Exit.OK
