"""``shearline study``: the paper's figures and tables as programs."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from functools import partial

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, positive

#: Parameters of the benchmark functions, as in the paper's figure 4.
PARAMETERS = 20
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
