"""``shearline view``: look at a run in Rerun."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_connect
from shearline.protocol.errors import ConfigError


def register(commands: Subparsers) -> None:
    """Add the command."""
    view = commands.add_parser("view", help="open a run in Rerun")
    view.add_argument("run", metavar="RUN_DIR", type=Path, nargs="?")
    view.add_argument("--live", action="store_true", help="attach to the run that is going on")
    view.add_argument("--save", metavar="FILE.rrd", type=Path, help="write a file, open no window")
    view.add_argument(
        "--trial",
        metavar="TRIAL",
        help="show one trial in full: its number, best, worst, failure, or why it failed (torque)",
    )
    view.add_argument("--beside", metavar="TRIAL", help="and another one beside it")
    add_connect(view)
    view.set_defaults(handler=view_run)


def view_run(arguments: argparse.Namespace) -> int:
    """Open the run in Rerun's viewer, or write what it would show to a file."""
    from shearline.record import view  # noqa: PLC0415 - loads rerun

    if arguments.live:
        view.view_live(arguments.connect, arguments.run)
        return Exit.OK
    if arguments.run is None:
        raise ConfigError("which run? give its folder, or --live for the one that is going on")
    if arguments.beside and not arguments.trial:
        raise ConfigError("--beside which? name the first trial with --trial")
    trials = [word for word in (arguments.trial, arguments.beside) if word]
    if arguments.save:
        run = view.save(arguments.run, arguments.save, trials=trials)
    else:
        run = view.view(arguments.run, trials=trials)
    for sentence in run.damage:
        print(f"shearline: {sentence}", file=sys.stderr)
    return Exit.OK
