"""``shearline up``: a learner and N evaluators on this machine, watched until the run ends."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shearline.deploy.exits import Exit
from shearline.deploy.options import (
    Subparsers,
    add_json,
    add_plant,
    add_run,
    add_traces,
    at_least,
    run_arguments,
    trace_arguments,
)

if TYPE_CHECKING:
    from shearline.deploy.launch import Launch


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
    add_plant(command)
    command.add_argument(
        "--listen",
        metavar="ENDPOINT",
        help="let others attach (default: a free port, this machine)",
    )
    add_traces(command)
    add_json(command)
    command.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> int:
    """Run to the end, then print the summary (with ``--json``: as the last line)."""
    from shearline.deploy.resolve import resolve_run  # noqa: PLC0415 - may import the user's task

    asked = resolve_run(arguments)
    from shearline.deploy.launch import Launch  # noqa: PLC0415 - loads zenoh
    from shearline.protocol.endpoints import check_endpoint, free_endpoint  # noqa: PLC0415

    launch = Launch(
        run_dir=asked.run_dir,
        listen=check_endpoint(arguments.listen or free_endpoint()),
        evaluators=arguments.evaluators,
        task=asked.own_task,
        evaluator_arguments=["--plant", arguments.plant, *trace_arguments(arguments)],
        learner_arguments=[*run_arguments(arguments), "--out", str(asked.run_dir)],
    )
    summary = _launched(launch, as_json=arguments.json)
    if arguments.json:
        print(json.dumps(summary))
    else:
        from shearline.deploy.summary import print_summary  # noqa: PLC0415 - loads rich

        space = asked.config.space
        print_summary(summary, asked.run_dir, dict(zip(space.names, space.units, strict=True)))
    return Exit.OK if summary["state"] == "complete" else Exit.INTERRUPTED


def _launched(launch: Launch, *, as_json: bool) -> dict[str, Any]:
    if as_json:
        from shearline.deploy.launch import QuietShow  # noqa: PLC0415 - loads zenoh

        return launch.run(QuietShow())
    from shearline.deploy.live import LiveShow  # noqa: PLC0415 - loads rich, for people only

    with LiveShow() as show:
        return launch.run(show)
