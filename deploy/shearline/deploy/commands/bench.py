"""``shearline bench``: side by side with the physical limit, in one run."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, positive, seconds


def register(commands: Subparsers) -> None:
    """Add the command and its benchmarks."""
    command = commands.add_parser("bench", help="measure against the physical limit")
    kinds = command.add_subparsers(title="benchmarks", metavar="NAME", required=True)

    sim = kinds.add_parser("sim", help="compiled trial loop against a bare engine loop")
    sim.add_argument("--seconds", type=seconds, default=20.0, help="how long to measure [s]")
    add_json(sim)
    sim.set_defaults(handler=bench_sim)

    learner = kinds.add_parser("learner", help="time of an update and its proposals by data size")
    add_json(learner)
    learner.set_defaults(handler=bench_learner)

    transport = kinds.add_parser(
        "transport", help="round trips and rate of the full path against a bare Zenoh echo"
    )
    transport.add_argument(
        "--starts", type=positive, default=7, help="fresh starts of each measurement (default 7)"
    )
    add_json(transport)
    transport.set_defaults(handler=bench_transport)


def bench_sim(arguments: argparse.Namespace) -> int:
    """Print how close a trial comes to the bare engine, and to real time."""
    from shearline.evaluator.skill.bench import measure  # noqa: PLC0415 - loads the engine

    return _print([measure(arguments.seconds)], as_json=arguments.json, single=True)


def bench_learner(arguments: argparse.Namespace) -> int:
    """Print a row per data size."""
    from shearline.learner.bench import measure  # noqa: PLC0415 - loads scikit-learn

    return _print(measure(), as_json=arguments.json, single=False)


def bench_transport(arguments: argparse.Namespace) -> int:
    """Print how close a trial's round trip comes to the network's own."""
    from shearline.deploy.transport.measure import measure  # noqa: PLC0415 - loads zenoh

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    figures = measure(arguments.starts, say=say)
    if arguments.json:
        return _print([figures], as_json=True, single=True)
    for name, value in figures.items():
        print(f"{name:24} {_short(value)}")
    return Exit.OK


def _print(rows: Sequence[Mapping[str, object]], *, as_json: bool, single: bool) -> int:
    if as_json:
        print(json.dumps(rows[0] if single else rows))
        return Exit.OK
    for row in rows:
        print("  ".join(f"{name} {_short(value)}" for name, value in row.items()))
    return Exit.OK


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
