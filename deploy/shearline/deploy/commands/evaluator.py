"""``shearline evaluator``: one process that asks a learner for trials and runs them."""

from __future__ import annotations

import argparse
import os
import sys
from typing import TYPE_CHECKING

from shearline.deploy.options import Subparsers, add_connect, add_plant, add_traces, positive
from shearline.protocol.errors import ConfigError

if TYPE_CHECKING:
    from shearline.evaluator.base import Task


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
    _add_robot(command)
    command.set_defaults(handler=run)


def _add_robot(command: argparse.ArgumentParser) -> None:
    group = command.add_argument_group("a robot (docs/robot.md)")
    group.add_argument("--robot", metavar="ROBOT", help="franka, panda, or module:Class")
    group.add_argument("--bounds", metavar="TOML", help="what this lab allows; owned by the lab")
    group.add_argument("--address", default="", help="of the robot")
    mode = group.add_mutually_exclusive_group()
    for name, what in (
        ("dry-run", "check everything, move nothing, ask no learner"),
        ("hover", "one slow trial in the air, without a learner"),
        ("calibrate", "show by hand where the lock is, without a learner"),
    ):
        mode.add_argument(
            f"--{name}", dest="mode", action="store_const", const=name, default="trials", help=what
        )
    mode.add_argument("--step", action="store_true", help="ask at the terminal before every trial")


def run(arguments: argparse.Namespace) -> int:
    """Run the worker in this process."""
    if arguments.robot is not None:
        return _run_robot(arguments)
    for option in ("bounds", "address", "step"):
        if getattr(arguments, option):
            raise ConfigError(f"--{option} is about a robot: name one with --robot")
    if arguments.mode != "trials":
        raise ConfigError(f"--{arguments.mode} is about a robot: name one with --robot")
    from shearline.evaluator.tasks import load_task  # noqa: PLC0415 - may import the user's task

    return _work(arguments, load_task(arguments.task, arguments.plant) if arguments.task else None)


def _run_robot(arguments: argparse.Namespace) -> int:
    """Attach a robot, or rehearse with it here."""
    from shearline.evaluator.robot.process import Orders  # noqa: PLC0415 - loads numpy
    from shearline.evaluator.robot.process import run as run_here  # noqa: PLC0415

    if arguments.bounds is None:
        raise ConfigError("a robot needs its lab's bounds: name the file with --bounds")
    orders = Orders(
        robot=arguments.robot,
        address=arguments.address,
        bounds=arguments.bounds,
        task=arguments.task or "keylock",
        mode=arguments.mode,
        step=arguments.step,
    )
    if orders.mode != "trials":
        over = run_here(orders)
        print(f"shearline: {over.why}", file=sys.stderr, flush=True)
        os._exit(over.code)  # a terminal that waits for a line must not keep us here
    from shearline.evaluator.robot.task import RobotTask  # noqa: PLC0415

    return _work(arguments, RobotTask(orders))


def _work(arguments: argparse.Namespace, task: Task | None) -> int:
    """Run the worker, and end this process."""
    import logging  # noqa: PLC0415 - with what logs

    from shearline.evaluator.worker import (  # noqa: PLC0415 - loads zenoh
        WorkerConfig,
        default_name,
        run_worker,
    )

    logging.basicConfig(format="%(asctime)s %(message)s", level=logging.INFO, stream=sys.stderr)
    config = WorkerConfig(
        connect=arguments.connect,
        name=arguments.name or default_name(arguments.bounds),
        credits=arguments.credits,
        plant=arguments.plant,
        wait_s=None if arguments.forever else arguments.patience,
        forever=arguments.forever,
        traces=not arguments.no_traces,
        trace_hz=arguments.trace_hz,
    )
    end = run_worker(config, task)
    print(f"shearline: {end.why}", file=sys.stderr, flush=True)
    # A session that will not close, or a trial that will not return, must not keep us here.
    os._exit(end.code)
