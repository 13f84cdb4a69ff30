"""``shearline learner``: lead a run; evaluators come from wherever they are started."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from shearline.deploy.exits import Exit
from shearline.deploy.options import ENDPOINT, Subparsers, add_json, add_run


def register(commands: Subparsers) -> None:
    """Add the command."""
    command = commands.add_parser(
        "learner",
        help="lead a run, without evaluators",
        description="Lead a run. Started again on the folder of an unfinished run, go on with it.",
    )
    command.add_argument("config", nargs="?", type=Path, metavar="FILE.toml", help="what to run")
    add_run(command)
    command.add_argument("--listen", default=ENDPOINT, help=f"default {ENDPOINT}")
    command.add_argument(
        "--through",
        metavar="ENDPOINT",
        help="a Zenoh router to connect to, where evaluators may connect as well",
    )
    command.add_argument(
        "--resume", action="store_true", help="refuse to begin a new run: there must be one"
    )
    add_json(command)
    command.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> int:
    """Lead the run in this process, with a recorder beside it."""
    from shearline.deploy.lead import lead  # noqa: PLC0415 - loads zenoh
    from shearline.deploy.resolve import resolve_run  # noqa: PLC0415 - may import the user's task

    asked = resolve_run(arguments)
    summary = lead(
        asked.config,
        asked.run_dir,
        arguments.listen,
        through=arguments.through,
        resume=arguments.resume,
    )
    if summary.why:
        print(f"shearline: {summary.why}", file=sys.stderr, flush=True)
    if arguments.json:
        print(json.dumps(summary.to_dict()), flush=True)
    elif summary.confirmation or summary.region_confirmation:
        from shearline.deploy.summary import confirmations  # noqa: PLC0415 - loads rich

        print("\n".join(confirmations(summary.to_dict())), flush=True)
    return {"complete": Exit.OK, "stopped": Exit.INTERRUPTED}.get(summary.state, Exit.RUN_FAILED)
