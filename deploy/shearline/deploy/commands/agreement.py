"""``shearline study agreement``: do the engines agree, and which is right where they do not?"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, positive

if TYPE_CHECKING:
    from shearline.evaluator.agreement.compare import Row


def register(kinds: Subparsers) -> None:
    """Add the study."""
    agreement = kinds.add_parser(
        "agreement",
        help="MuJoCo and PyBullet side by side, and beside closed forms",
        description="The same motions, forces, insertions and tuples on both engines; exit code 4"
        " where they differ by more than they may.",
    )
    agreement.add_argument(
        "--tuples", type=positive, default=50, metavar="N", help="verdicts compared, default 50"
    )
    agreement.add_argument(
        "--task",
        default="keylock",
        metavar="LEVEL",
        help="on which their verdicts are compared, such as keylock+grasp+pads+noise;"
        " default keylock",
    )
    agreement.add_argument(
        "--motions", type=positive, default=10, metavar="N", help="through free space, default 10"
    )
    agreement.add_argument(
        "--out", type=Path, default=Path("runs/agreement"), help="default runs/agreement"
    )
    agreement.add_argument("--no-picture", action="store_true", help="draw nothing")
    add_json(agreement)
    agreement.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> int:
    """Print each comparison as it is done; then draw."""
    from shearline.evaluator.agreement.compare import Findings, compare  # noqa: PLC0415 - engines

    found = Findings()
    for row in compare(arguments.tuples, arguments.motions, found, arguments.task):
        if not arguments.json:
            print(line(row), flush=True)
    pictures = []
    if not arguments.no_picture:
        from shearline.deploy.studies import agreement_picture  # noqa: PLC0415 - with matplotlib

        pictures = [arguments.out / "agreement.png"]
        agreement_picture.draw(found, pictures[0])
    if arguments.json:
        rows = [asdict(row) | {"agrees": row.agrees} for row in found.rows]
        tried = [asdict(one) for one in found.tried]
        said = {"rows": rows, "tried": tried, "pictures": [str(path) for path in pictures]}
        print(json.dumps(said))
    else:
        for path in pictures:
            print(f"drawn: {path}")
    return Exit.OK if all(row.agrees for row in found.rows) else Exit.RUN_FAILED


def line(row: Row) -> str:
    """Say one comparison in one line."""
    expected = "" if row.expected is None else f", expected {row.expected:.5g}"
    verdict = "" if row.agrees else "  <- too much"
    values = f"{row.mujoco:.5g} and {row.pybullet:.5g} {row.unit}".rstrip()
    return (
        f"{row.what}: {values}{expected}; difference {row.difference:.2g}"
        f" of at most {row.limit:g}{verdict}"
    )
