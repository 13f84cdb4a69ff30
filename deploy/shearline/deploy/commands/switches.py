"""``shearline study switches``: what each choice of a learner is worth."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, positive

if TYPE_CHECKING:
    from shearline.studies.benchmark import Row

#: Names of the tables; the study itself is not imported before it is asked for.
TABLES = ("psp", "partitioners", "rivals")
PROBLEMS = ("sphere", "rastrigin", "ridge")
#: Parameters of the functions, and trials of an episode there (the paper's section 4.1).
PARAMETERS = 20
EPISODE_LENGTH = 40
#: Trials of an episode on the ridge problem, as on the lock (the paper's section 5).
EPISODE_LENGTH_RIDGE = 20


def register(kinds: Subparsers) -> None:
    """Add the study."""
    switches = kinds.add_parser(
        "switches",
        help="what each switch of a learner is worth",
        description="Learners with one thing changed at a time, 10 episodes: mean best cost on"
        " shifted functions of 20 parameters (40 trials an episode), and success in the last three"
        " episodes beside a cheap, fragile ridge (20 trials an episode).",
    )
    switches.add_argument("table", choices=TABLES)
    switches.add_argument(
        "--problems", nargs="+", choices=PROBLEMS, default=PROBLEMS, help="default: all"
    )
    switches.add_argument(
        "--experiments", type=positive, default=20, metavar="M", help="seeds, default 20"
    )
    add_json(switches)
    switches.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> int:
    """Print a row for each variant on each problem as it is done."""
    from shearline.sims import functions  # noqa: PLC0415 - heavy
    from shearline.studies.switches import TABLES, switches  # noqa: PLC0415

    variants, seeds = TABLES[arguments.table], range(arguments.experiments)
    rows = []
    for name in arguments.problems:
        ridge = name == "ridge"
        problem = (
            (lambda _: functions.fragile_ridge())
            if ridge
            else partial(functions.shifted, getattr(functions, name), PARAMETERS)
        )
        length = EPISODE_LENGTH_RIDGE if ridge else EPISODE_LENGTH
        for row in switches(problem, variants, seeds=seeds, episode_length=length):
            rows.append(row)
            if not arguments.json:
                print(_line(row, ridge=ridge), flush=True)
    if arguments.json:
        print(json.dumps([asdict(row) for row in rows]))
    return Exit.OK


def _line(row: Row, *, ridge: bool) -> str:
    found = (
        f"{100 * row.success_late:6.1f} +- {100 * row.success_late_se:.1f} % succeed late"
        if ridge
        else f"best {row.best:7.2f} +- {row.best_se:.2f}"
    )
    return f"{row.problem:<20} {row.learner:<28} {found}  ({row.learner_s:.2f} s of learner a run)"
