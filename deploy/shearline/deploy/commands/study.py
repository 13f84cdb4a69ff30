"""``shearline study``: the paper's figures and tables as programs."""

from __future__ import annotations

import argparse
import json
import statistics
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, at_least, positive

#: Parameters of the benchmark functions, as in the paper's figure 4.
PARAMETERS = 20
LEVELS = ("keylock", "keylock-limit", "keylock-jam")
LEARNERS = ("psp", "psp-paper", "lhs", "random")


def register(commands: Subparsers) -> None:
    """Add the command and its studies."""
    command = commands.add_parser("study", help="reproduce a figure or table")
    kinds = command.add_subparsers(title="studies", metavar="NAME", required=True)
    functions = kinds.add_parser(
        "functions",
        help="sphere and Rastrigin in 20 dimensions",
        description="Mean best cost after 10 episodes of 40, each seed with its own optimum.",
    )
    functions.add_argument("--experiments", type=positive, default=20, metavar="M")
    functions.add_argument("--learners", nargs="+", default=LEARNERS, metavar="NAME")
    add_json(functions)
    functions.set_defaults(handler=run_functions)

    lock = kinds.add_parser(
        "lock",
        help="a learner on the key-in-lock, its recommendation tried on fresh noise",
        description="Runs of 10 episodes of 20 trials through the whole system, seed by seed.",
    )
    lock.add_argument("--task", choices=LEVELS, default=LEVELS[0])
    lock.add_argument("--learner", default="psp")
    lock.add_argument("--experiments", type=positive, default=5, metavar="M")
    lock.add_argument("--first-seed", type=at_least(0), default=0, metavar="S")
    lock.add_argument("--fresh", type=positive, default=100, metavar="N", help="default 100")
    lock.add_argument("--workers", type=positive, default=2, metavar="W", help="evaluators")
    lock.add_argument("--out", type=Path, help="folder for the runs (default runs/study-TIME)")
    add_json(lock)
    lock.set_defaults(handler=run_lock)


def run_functions(arguments: argparse.Namespace) -> int:
    """Print the mean best cost of each learner on each function, as each is done."""
    from shearline.learner.registry import resolve  # noqa: PLC0415 - with what it checks
    from shearline.sims import functions  # noqa: PLC0415
    from shearline.studies.benchmark import benchmark  # noqa: PLC0415

    for name in arguments.learners:
        resolve(name)
    rows = []
    for function in (functions.sphere, functions.rastrigin):
        for name in arguments.learners:
            rows += benchmark(
                [name],
                partial(functions.shifted, function, PARAMETERS),
                seeds=range(arguments.experiments),
            )
            if not arguments.json:
                row = rows[-1]
                print(
                    f"{row.problem:<24} {row.learner:<10} best {row.best:8.2f} +- {row.best_se:.2f}"
                    f"  ({row.runs} runs, {row.learner_s:.2f} s of learner each)",
                    flush=True,
                )
    if arguments.json:
        print(json.dumps([asdict(row) for row in rows]))
    return Exit.OK


def run_lock(arguments: argparse.Namespace) -> int:
    """Print one line per experiment as it is done, then the means."""
    from shearline.deploy.lock_study import experiments  # noqa: PLC0415 - loads zenoh
    from shearline.learner.registry import resolve  # noqa: PLC0415

    resolve(arguments.learner)
    first = arguments.first_seed
    done = []
    for one in experiments(
        arguments.task,
        arguments.learner,
        range(first, first + arguments.experiments),
        evaluators=arguments.workers,
        fresh=arguments.fresh,
        folder=arguments.out or Path("runs", time.strftime("study-%Y%m%d-%H%M%S")),
    ):
        done.append(one)
        if not arguments.json:
            episodes = " ".join(f"{100 * rate:3.0f}" for rate in one.success)
            print(
                f"seed {one.seed}: {episodes} %, recommended {100 * one.fresh_success:.0f} % at"
                f" {one.fresh_cost:.2f} s (claimed >= {100 * one.claimed:.0f} %),"
                f" {one.wall_s:.0f} s",
                flush=True,
            )
    if arguments.json:
        print(json.dumps([asdict(one) for one in done]))
        return Exit.OK
    print(
        f"mean: first episode {100 * statistics.fmean(one.success[0] for one in done):.1f} %,"
        f" last three {100 * statistics.fmean(one.late_success for one in done):.1f} %,"
        f" recommended {100 * statistics.fmean(one.fresh_success for one in done):.1f} %"
        f" at {statistics.fmean(one.fresh_cost for one in done):.2f} s"
    )
    return Exit.OK
