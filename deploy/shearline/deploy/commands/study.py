"""``shearline study``: the paper's figures and tables as programs."""

from __future__ import annotations

import argparse

from shearline.deploy.options import Subparsers, add_json, positive


def register(commands: Subparsers) -> None:
    """Add the command and its studies."""
    command = commands.add_parser("study", help="reproduce a figure or table")
    kinds = command.add_subparsers(title="studies", metavar="NAME", required=True)
    functions = kinds.add_parser("functions", help="sphere and Rastrigin, 20-D, shifted")
    functions.add_argument("--experiments", type=positive, default=20, metavar="M")
    add_json(functions)
    functions.set_defaults(handler=run_functions)


def run_functions(arguments: argparse.Namespace) -> int:
    """Print the mean best cost of each learner on each function."""
    raise NotImplementedError(arguments)
