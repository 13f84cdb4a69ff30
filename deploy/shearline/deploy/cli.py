"""The ``shearline`` command: one parser, one module per command, one way errors end.

Command modules are cheap to import; what is heavy (zenoh, mujoco, scikit-learn, rerun) is imported
by the command that needs it, when it runs.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from shearline.deploy.commands import (
    bench,
    doctor,
    evaluator,
    learner,
    operate,
    replay,
    report,
    show,
    study,
    trials,
    up,
)
from shearline.deploy.exits import complain
from shearline.deploy.processes import die_with_parent

EPILOG = """\
exit codes: 0 done, 2 wrong usage, 3 could not connect, 4 run failed, 130 interrupted
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    die_with_parent()
    arguments = parser().parse_args(argv)
    try:
        code = int(arguments.handler(arguments))
        sys.stdout.flush()  # here, where a reader that left is no error
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - complain() re-raises bugs
        return int(complain(error))
    return code


def parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    top = argparse.ArgumentParser(
        prog="shearline",
        description="Learn a tight robot task by trying it many times on many machines at once.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for module in (
        up,
        learner,
        evaluator,
        operate,
        trials,
        report,
        show,
        replay,
        bench,
        study,
        doctor,
    ):
        module.register(commands)
    return top
