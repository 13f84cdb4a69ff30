"""``shearline bench``: side by side with the physical limit, in one run."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, at_least, positive, seconds

#: A learner is measured once it has been told an episode.
LEARNER_TRIALS_MIN = 40


def register(commands: Subparsers) -> None:
    """Add the command and its benchmarks."""
    command = commands.add_parser("bench", help="measure against the physical limit")
    kinds = command.add_subparsers(title="benchmarks", metavar="NAME", required=True)

    sim = kinds.add_parser("sim", help="compiled trial loop against a bare engine loop")
    sim.add_argument("--seconds", type=seconds, default=20.0, help="how long to measure [s]")
    add_json(sim)
    sim.set_defaults(handler=bench_sim)

    learner = kinds.add_parser(
        "learner", help="time and memory of an update and its proposals by data size"
    )
    learner.add_argument(
        "--learner", default="psp-ranked", metavar="NAME", help="default %(default)s"
    )
    learner.add_argument(
        "--sizes", type=at_least(LEARNER_TRIALS_MIN), nargs="+", metavar="N", help="trials told"
    )
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

    record = kinds.add_parser("record", help="a key-lock run with and without its record, in turns")
    record.add_argument("--rounds", type=positive, default=5, help="pairs of runs (default 5)")
    record.add_argument("--trials", type=positive, default=100, help="per run (default 100)")
    add_json(record)
    record.set_defaults(handler=bench_record)


def bench_record(arguments: argparse.Namespace) -> int:
    """Print what recording costs a key-lock run."""
    from shearline.deploy.record_bench import measure  # noqa: PLC0415 - loads zenoh

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    figures = measure(arguments.rounds, trials=arguments.trials, say=say)
    if arguments.json:
        return _print([figures], as_json=True, single=True)
    for name, value in figures.items():
        print(f"{name:24} {_short(value)}")
    return Exit.OK


def bench_sim(arguments: argparse.Namespace) -> int:
    """Print how close a trial comes to the bare engine, and to real time."""
    from shearline.evaluator.skill.bench import measure  # noqa: PLC0415 - loads the engine

    return _print([measure(arguments.seconds)], as_json=arguments.json, single=True)


def bench_learner(arguments: argparse.Namespace) -> int:
    """Print a row per data size, clean and with flipped labels, as each is measured."""
    import msgspec  # noqa: PLC0415 - with the learner

    from shearline.learner.bench import SIZES, measure  # noqa: PLC0415 - loads numpy

    rows = []
    for row in measure(arguments.learner, arguments.sizes or SIZES):
        rows.append(msgspec.to_builtins(row))
        if not arguments.json:
            _print(rows[-1:], as_json=False, single=False)
            sys.stdout.flush()
    return _print(rows, as_json=True, single=False) if arguments.json else Exit.OK


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
