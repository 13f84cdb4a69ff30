"""``shearline evaluator``: one process that asks a learner for trials and runs them."""

from __future__ import annotations

import argparse
import os
import sys

from shearline.deploy.options import Subparsers, add_connect, add_plant, add_traces, positive


def register(commands: Subparsers) -> None:
    """Add the command."""
    command = commands.add_parser(
        "evaluator",
        help="run trials for a learner",
        description="Run trials for a learner until the run ends; outlives its restarts.",
    )
    add_connect(command, patience_s=10.0)
    command.add_argument("--name", help="unique name in the run (default HOST-PID)")
    command.add_argument("--task", help="your own task, file:function (default: the learner's)")
    add_plant(command)
    command.add_argument("--credits", type=positive, default=2, help="trials held at once")
    command.add_argument("--forever", action="store_true", help="wait for the next run too")
    add_traces(command)
    command.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the worker in this process."""
    import logging  # noqa: PLC0415 - with what logs

    from shearline.evaluator.tasks import load_task  # noqa: PLC0415 - may import the user's task
    from shearline.evaluator.worker import (  # noqa: PLC0415 - loads zenoh
        WorkerConfig,
        default_name,
        run_worker,
    )

    logging.basicConfig(format="%(asctime)s %(message)s", level=logging.INFO, stream=sys.stderr)
    config = WorkerConfig(
        connect=arguments.connect,
        name=arguments.name or default_name(),
        credits=arguments.credits,
        plant=arguments.plant,
        wait_s=None if arguments.forever else arguments.patience,
        forever=arguments.forever,
        traces=not arguments.no_traces,
        trace_hz=arguments.trace_hz,
    )
    end = run_worker(config, load_task(arguments.task, arguments.plant) if arguments.task else None)
    print(f"shearline: {end.why}", file=sys.stderr, flush=True)
    # A session that will not close, or a trial that will not return, must not keep us here.
    os._exit(end.code)
