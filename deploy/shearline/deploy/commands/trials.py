"""``shearline trials``: the trials of a run, for people and for other programs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json
from shearline.protocol.errors import ConfigError

if TYPE_CHECKING:
    from shearline.record.reader import Run

FORMATS = ("json", "csv", "parquet")


def register(commands: Subparsers) -> None:
    """Add the command."""
    trials = commands.add_parser("trials", help="list the trials of a run, or hand them on")
    trials.add_argument("run", metavar="RUN_DIR", type=Path)
    trials.add_argument("--format", choices=FORMATS, help="print them for programs")
    trials.add_argument("--out", type=Path, metavar="FILE", help="write there, print nothing")
    add_json(trials)
    trials.set_defaults(handler=list_trials)


def list_trials(arguments: argparse.Namespace) -> int:
    """Print one line per trial: columns for people, or a format for programs."""
    form = arguments.format or ("json" if arguments.json else None)
    if arguments.out and form is None:
        raise ConfigError(f"which format? give --format {'|'.join(FORMATS)} with --out")
    if form == "parquet" and not arguments.out and sys.stdout.isatty():
        raise ConfigError("Parquet is not for a terminal: give --out FILE.parquet")
    from shearline.deploy.opened import opened  # noqa: PLC0415 - loads what leads a run

    run = opened(arguments.run)
    for sentence in run.damage:
        print(f"shearline: {sentence}", file=sys.stderr)
    if form is None:
        _print_table(run)
    else:
        _hand_on(run, form, arguments.out)
    return Exit.OK


def _hand_on(run: Run, form: str, out: Path | None) -> None:
    from shearline.record.export import Format, exported  # noqa: PLC0415 - with the reader

    written = exported(run, Format(form))
    if out:
        out.write_bytes(written)
    else:
        sys.stdout.buffer.write(written)


def _print_table(run: Run) -> None:
    print(
        f"{'trial':>5} {'episode':>7}  {'outcome':<8} {'cost':>9} {'attempts':>8}  evaluator, why"
    )
    for row in run.trials():
        cost = "-" if row["cost"] is None else f"{row['cost']:.4g}"
        print(
            f"{row['trial']:>5} {row['episode'] + 1:>7}  {row['outcome']:<8} {cost:>9}"
            f" {row['attempts']:>8}  {_who(row)} {row['why']}"
        )


def _who(row: Mapping[str, Any]) -> str:
    """Return the evaluator, and its kind where that is not the usual one."""
    usual = row["evaluator_kind"] in {"", "simulator", "function"}
    return f"{row['evaluator']}" if usual else f"{row['evaluator']} ({row['evaluator_kind']})"
