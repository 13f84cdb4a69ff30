"""``shearline study claims``: do learners keep their word?"""

from __future__ import annotations

import argparse
import json

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, at_least, positive
from shearline.protocol.errors import ConfigError


def register(kinds: Subparsers) -> None:
    """Add the study."""
    claims = kinds.add_parser(
        "claims",
        help="what learners claim for their recommendation, beside what is true",
        description="Noisy problems whose true chance of success is known: how often the interval"
        " of the recommended tuple holds it, and how often draws from the region succeed at least"
        " as often as claimed.",
    )
    claims.add_argument("--learners", nargs="+", metavar="NAME", default=["psp", "lhs"])
    claims.add_argument("--problems", nargs="+", metavar="NAME", help="default: all")
    claims.add_argument(
        "--experiments", type=positive, default=60, metavar="M", help="seeds, default 60"
    )
    claims.add_argument("--first-seed", type=at_least(0), default=0, metavar="S")
    add_json(claims)
    claims.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> int:
    """Print a row for each learner and problem as it is done."""
    import msgspec  # noqa: PLC0415 - with the study

    from shearline.deploy.studies.claims import PROBLEMS, coverages  # noqa: PLC0415 - heavy
    from shearline.learner.registry import resolve  # noqa: PLC0415
    from shearline.studies.claims import table  # noqa: PLC0415

    problems = arguments.problems or list(PROBLEMS)
    unknown = [name for name in problems if name not in PROBLEMS]
    if unknown:
        raise ConfigError(
            f"no problem is called {unknown[0]!r}: expected one of {', '.join(PROBLEMS)}"
        )
    learners = [resolve(name) for name in arguments.learners]
    first = arguments.first_seed
    seeds = range(first, first + arguments.experiments)
    rows = []
    for row in coverages(learners, problems, seeds):
        rows.append(row)
        if not arguments.json:
            lines = table([row])
            print("\n".join(lines if len(rows) == 1 else lines[1:]), flush=True)
    if arguments.json:
        print(json.dumps(msgspec.to_builtins(rows)))
    return Exit.OK
