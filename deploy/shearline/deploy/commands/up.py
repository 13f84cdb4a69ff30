"""``shearline up``: a learner and N evaluators on this machine, watched until the run ends."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, add_run, at_least


def register(commands: Subparsers) -> None:
    """Add the command."""
    command = commands.add_parser(
        "up",
        help="learner + evaluators on this machine, live table",
        description="Start a learner and evaluators here, watch the run, end with a summary.",
    )
    command.add_argument("config", nargs="?", type=Path, metavar="FILE.toml", help="what to run")
    add_run(command)
    command.add_argument("--evaluators", type=at_least(0), default=2, metavar="E", help="default 2")
    command.add_argument("--plant", choices=("mujoco",), default="mujoco", help="what to act on")
    command.add_argument(
        "--listen",
        metavar="ENDPOINT",
        help="let others attach (default: a free port, this machine)",
    )
    add_json(command)
    command.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> int:
    """Run to the end, then print the summary (with ``--json``: as the last line)."""
    from shearline.deploy.resolve import resolve_run  # noqa: PLC0415 - may import the user's task

    from shearline.deploy.launch import Launch, free_endpoint  # noqa: PLC0415 - loads zenoh

    config, run_dir = resolve_run(arguments)
    launch = Launch(
        config=config,
        run_dir=run_dir,
        listen=arguments.listen or free_endpoint(),
        evaluators=arguments.evaluators,
        task=arguments.task,
        plant=arguments.plant,
        quiet=arguments.json,
    )
    summary = launch.run()
    if arguments.json:
        print(json.dumps(summary))
    else:
        from shearline.deploy.summary import print_summary  # noqa: PLC0415 - loads rich

        print_summary(summary, run_dir)
    return Exit.OK
