"""``shearline evaluator``: one process that asks a learner for trials and runs them."""

from __future__ import annotations

import argparse

from shearline.deploy.options import Subparsers, add_connect, at_least, positive


def register(commands: Subparsers) -> None:
    """Add the command."""
    command = commands.add_parser(
        "evaluator",
        help="run trials for a learner",
        description="Run trials for a learner until the run ends; outlives its restarts.",
    )
    add_connect(command)
    command.add_argument("--name", help="unique name in the run (default HOST-PID)")
    command.add_argument("--task", help="your own task, file:function (default: the learner's)")
    command.add_argument("--plant", choices=("mujoco",), default="mujoco", help="what to act on")
    command.add_argument("--credits", type=positive, default=2, help="trials held at once")
    command.add_argument(
        "--patience",
        type=at_least(0),
        metavar="S",
        help="give up after S seconds without a learner (default: never)",
    )
    command.add_argument("--forever", action="store_true", help="wait for the next run too")
    command.add_argument("--no-traces", action="store_true", help="send no traces to the record")
    command.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the worker in this process."""
    raise NotImplementedError(arguments)
