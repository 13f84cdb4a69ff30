"""``shearline report``: one page about a run, or about several side by side."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json


def register(commands: Subparsers) -> None:
    """Add the command."""
    command = commands.add_parser(
        "report",
        help="write one HTML page about a run, or compare several",
        description="Write one self-contained HTML page: what was learned, what failed, and why.",
    )
    command.add_argument("runs", metavar="RUN_DIR", type=Path, nargs="+")
    command.add_argument(
        "--out",
        type=Path,
        metavar="FILE.html",
        help="default RUN_DIR/report.html, or comparison.html for several runs",
    )
    add_json(command)
    command.set_defaults(handler=write_report)


def write_report(arguments: argparse.Namespace) -> int:
    """Write the page and say where it is."""
    from shearline.record.report import write  # noqa: PLC0415 - mcap loads on use

    path = write(arguments.runs, arguments.out)
    if arguments.json:
        print(json.dumps({"report": str(path), "bytes": path.stat().st_size}))
    else:
        print(f"written to {path}: open it in a browser")
    return Exit.OK
