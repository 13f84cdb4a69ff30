"""Arguments that several commands share, each defined once."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TypeAlias

# argparse gives what add_subparsers() returns no public name.
Subparsers: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"  # noqa: SLF001

#: What evaluators can act on, the usual one first; as in :mod:`shearline.evaluator.plants`, which
#: is not loaded to parse arguments.
PLANTS = ("mujoco", "pybullet")

#: Where a learner listens when nobody says otherwise: this machine only.
ENDPOINT = "tcp/127.0.0.1:7447"


def positive(text: str) -> int:
    """Parse a whole number of at least 1."""
    return at_least(1)(text)


def at_least(low: int) -> Callable[[str], int]:
    """Return a parser of whole numbers of at least ``low``."""

    def parse(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = low - 1
        if number < low:
            raise argparse.ArgumentTypeError(f"expected a whole number >= {low}, got {text!r}")
        return number

    return parse


def seconds(text: str) -> float:
    """Parse a positive, finite time [s]."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1e6:
        raise argparse.ArgumentTypeError(f"expected seconds > 0, got {text!r}")
    return value


def kind_and_number(text: str) -> tuple[str, int]:
    """Parse ``KIND:N``: a kind of evaluators and a whole number of at least 1."""
    kind, _, number = text.partition(":")
    if kind not in {"simulator", "function", "robot"} or not number:
        raise argparse.ArgumentTypeError(
            f"expected simulator:N, function:N or robot:N, got {text!r}"
        )
    return kind, positive(number)


def add_json(command: argparse.ArgumentParser) -> None:
    """``--json``: print for programs instead of people."""
    command.add_argument("--json", action="store_true", help="print JSON for programs")


def add_connect(command: argparse.ArgumentParser, *, patience_s: float = 5.0) -> None:
    """``--connect``: the learner's endpoint, and ``--patience``: how long to look for it."""
    command.add_argument(
        "--patience",
        type=seconds,
        default=patience_s,
        metavar="S",
        help=f"look for a learner for at most S seconds (default {patience_s:g})",
    )
    command.add_argument(
        "--connect",
        default=ENDPOINT,
        metavar="ENDPOINT",
        help=f"the learner's endpoint (default {ENDPOINT})",
    )


def add_plant(command: argparse.ArgumentParser) -> None:
    """``--plant``: what evaluators act on."""
    command.add_argument(
        "--plant", choices=PLANTS, default=PLANTS[0], help=f"what to act on (default {PLANTS[0]})"
    )


def add_traces(command: argparse.ArgumentParser) -> None:
    """``--trace-hz`` and ``--no-traces``: what evaluators show of each trial."""
    command.add_argument(
        "--trace-hz",
        type=seconds,
        default=1000.0,
        metavar="HZ",
        help="samples of a trace per second of the trial's clock, at most (default 1000)",
    )
    command.add_argument("--no-traces", action="store_true", help="send no traces to the record")


def trace_arguments(arguments: argparse.Namespace) -> list[str]:
    """Return what :func:`add_traces` parsed, as arguments again, for a child process."""
    rate = ["--trace-hz", str(arguments.trace_hz)]
    return [*rate, "--no-traces"] if arguments.no_traces else rate


def add_run(command: argparse.ArgumentParser) -> None:
    """Arguments that say what a run is; each overrides the TOML file, if one is given."""
    group = command.add_argument_group("the run")
    group.add_argument(
        "--task",
        help="keylock, keylock-limit, keylock-jam, with switches behind it or without"
        " (keylock+grasp+noise), sphere, or file:function",
    )
    learners = "psp-ranked (default), psp, psp-paper, hireps, cmaes, ga, pso, lhs, random, tpe"
    group.add_argument("--learner", help=learners)
    group.add_argument("--episodes", type=positive, metavar="K", help="updates (default 10)")
    group.add_argument("--trials", type=positive, metavar="N", help="per episode (default 20)")
    group.add_argument("--seed", type=at_least(0), metavar="S", help="default 0")
    group.add_argument(
        "--confirm",
        type=at_least(0),
        metavar="N",
        help="then try the recommended tuple N times on fresh noise, and say how often it worked",
    )
    group.add_argument(
        "--confirm-on",
        type=kind_and_number,
        metavar="KIND:N",
        help="as --confirm N, but on evaluators of one kind only, e.g. robot:20",
    )
    group.add_argument(
        "--confirm-region",
        type=at_least(0),
        metavar="N",
        help="and N tuples drawn from the recommended region",
    )
    group.add_argument(
        "--warm-start",
        metavar="RUN",
        help="start from the trials of another run on the same parameters; they fade by half"
        " with every episode",
    )
    group.add_argument("--lease", type=seconds, metavar="S", help="lease of an attempt [s]")
    group.add_argument("--out", metavar="RUN_DIR", help="run folder (default runs/TASK-TIME)")
    group.add_argument("--no-record", action="store_true", help="write no record.mcap")


def reach(listen: str) -> str:
    """Return where a process on this machine reaches who listens at an endpoint."""
    return listen.replace("/0.0.0.0:", "/127.0.0.1:").replace("/[::]:", "/[::1]:")


def run_arguments(arguments: argparse.Namespace) -> list[str]:
    """Return what :func:`add_run` parsed, as arguments again, for a child process."""
    values = {
        "--task": arguments.task,
        "--learner": arguments.learner,
        "--episodes": arguments.episodes,
        "--trials": arguments.trials,
        "--seed": arguments.seed,
        "--confirm": arguments.confirm,
        "--confirm-on": ":".join(map(str, arguments.confirm_on or ())) or None,
        "--confirm-region": arguments.confirm_region,
        "--warm-start": arguments.warm_start,
        "--lease": arguments.lease,
    }
    words = [str(arguments.config)] if arguments.config is not None else []
    for option, value in values.items():
        if value is not None:
            words += [option, str(value)]
    return words + (["--no-record"] if arguments.no_record else [])
