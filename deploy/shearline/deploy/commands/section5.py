"""``shearline study table1|table2|fig6|reliability|transfer``: the paper's section 5 on the lock.

All draw on one set of runs in one folder: what one of them has run, the others read.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, add_plant, at_least, positive
from shearline.evaluator.plants import DEFAULT, PLANTS
from shearline.protocol.errors import ConfigError

if TYPE_CHECKING:
    from shearline.deploy.studies.dataset import Gathering, Size
    from shearline.studies.experiment import Experiment
    from shearline.studies.section5 import Table

LEVELS = ("keylock", "keylock-limit", "keylock-jam")
#: What a lab varies all at once, for transfer; levels that have some of it leave that out.
VARIATION = ("friction", "pins", "grasp", "pads", "noise")


@dataclass(frozen=True, slots=True)
class Study:
    """One of the studies.

    Attributes:
        help: What it shows.
        tried: Whether it needs the trials of cheapest tuples and of draws around.
        tables: Names of its tables in :mod:`shearline.studies.section5`.
        picture: Name of the function that draws it, ``""``: none.
    """

    help: str
    tried: bool
    tables: tuple[str, ...]
    picture: str = ""


STUDIES = {
    "table1": Study(
        help="optimised costs, and what they cost again", tried=True, tables=("table1",)
    ),
    "table2": Study(
        help="successful trials by episode",
        tried=False,
        tables=("table2",),
        picture="draw_success",
    ),
    "fig6": Study(
        help="costs trial by trial", tried=False, tables=("table2",), picture="draw_fig6"
    ),
    "reliability": Study(
        help="recommended and cheapest tuples on fresh noise, and draws around them",
        tried=True,
        tables=("reliability", "subspace"),
        picture="draw_subspace",
    ),
}


def register(kinds: Subparsers) -> None:
    """Add the studies."""
    for name, study in STUDIES.items():
        kind = kinds.add_parser(
            name,
            help=f"the paper's section 5 on the lock: {study.help}",
            description="Runs of 10 episodes of 20 trials through the whole system, for each"
            " learner and seed. One folder serves all studies of section 5; killed and started"
            " again, only what is missing is run.",
        )
        kind.add_argument("--level", default=LEVELS[0], metavar="TASK", help=", ".join(LEVELS))
        kind.add_argument("--learners", nargs="+", metavar="NAME", help="default: all but tpe")
        add_plant(kind)
        kind.add_argument("--markdown", action="store_true", help="print tables as Markdown")
        kind.add_argument("--no-picture", action="store_true", help="draw nothing")
        _add_common(kind)
        kind.set_defaults(handler=lambda arguments, name=name: run(name, arguments))
    _register_transfer(kinds)


def _register_transfer(kinds: Subparsers) -> None:
    kind = kinds.add_parser(
        "transfer",
        help="learned on one plant and task, tried on every other",
        description="The recommended tuples of each place, tried in every place.",
    )
    kind.add_argument("--learner", default="best", metavar="NAME")
    kind.add_argument("--level", default=LEVELS[0], metavar="TASK", help=", ".join(LEVELS))
    kind.add_argument("--plants", nargs="+", choices=PLANTS, default=[DEFAULT])
    kind.add_argument(
        "--tasks",
        nargs="+",
        metavar="TASK",
        help="default: the level, without and with all that a lab varies",
    )
    kind.add_argument("--markdown", action="store_true", help="print the table as Markdown")
    _add_common(kind)
    kind.set_defaults(handler=run_transfer)


def _add_common(kind: argparse.ArgumentParser) -> None:
    kind.add_argument("--experiments", type=positive, default=10, metavar="M", help="default 10")
    kind.add_argument("--first-seed", type=at_least(0), default=0, metavar="S")
    kind.add_argument("--workers", type=positive, default=2, metavar="W", help="runs at once")
    kind.add_argument("--episodes", type=positive, default=10, metavar="K")
    kind.add_argument("--trials", type=positive, default=20, metavar="N", help="of each episode")
    kind.add_argument(
        "--fresh", type=positive, default=100, metavar="N", help="re-runs of a tuple, default 100"
    )
    kind.add_argument(
        "--around",
        type=positive,
        default=25,
        metavar="N",
        help="draws of each spread around a recommendation, default 25",
    )
    kind.add_argument("--no-record", action="store_true", help="write journals only")
    kind.add_argument(
        "--renew", action="store_true", help="run again what was made by other code of a learner"
    )
    kind.add_argument("--out", type=Path, default=Path("runs", "section5"), help="%(default)s")
    add_json(kind)


def run(name: str, arguments: argparse.Namespace) -> int:
    """Run what is missing, saying what each run came to, then print tables and draw."""
    from shearline.deploy.studies.contenders import USUAL, contender  # noqa: PLC0415
    from shearline.deploy.studies.dataset import Wanted  # noqa: PLC0415 - loads zenoh
    from shearline.studies import section5  # noqa: PLC0415

    study = STUDIES[name]
    asked = dict.fromkeys(map(contender, arguments.learners or USUAL))
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.experiments)
    gathering, size = _gathering(arguments), _size(arguments)
    wanted = [
        Wanted(who, arguments.level, arguments.plant, seed, size) for who in asked for seed in seeds
    ]
    found = gathering.experiments(wanted, tried=study.tried)
    make: Sequence[Callable[[list[Experiment]], Table]]
    make = [getattr(section5, table) for table in study.tables]
    pictures = []
    if study.picture and not arguments.no_picture:
        from shearline.studies import section5_picture  # noqa: PLC0415 - with matplotlib

        pictures = [arguments.out / f"{name}-{arguments.level}-{arguments.plant}.png"]
        getattr(section5_picture, study.picture)(found, pictures[0])
    data = {"curves": section5.fig6(found), "experiments": _plain(found)}
    _finish(arguments, [one(found) for one in make], gathering, data, pictures)
    return Exit.OK


def run_transfer(arguments: argparse.Namespace) -> int:
    """Run what is missing, then print the table."""
    from shearline.deploy.studies.contenders import contender  # noqa: PLC0415
    from shearline.deploy.studies.transfer import places_of, table, transfer  # noqa: PLC0415
    from shearline.evaluator.builtin import builtin_spec  # noqa: PLC0415

    tasks = arguments.tasks or [arguments.level, _varied(arguments.level, VARIATION)]
    tasks = list(dict.fromkeys(builtin_spec(task).name for task in tasks))
    places = places_of(arguments.plants, tasks)
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.experiments)
    gathering = _gathering(arguments)
    found = transfer(gathering, contender(arguments.learner), places, seeds, _size(arguments))
    data = {"travelled": _plain(found)}
    _finish(arguments, [table(found)], gathering, data, [])
    return Exit.OK


def _varied(level: str, switches: Sequence[str]) -> str:
    """Return a level's name with those of these switches that change something."""
    from shearline.evaluator.keylock_variation import level as check  # noqa: PLC0415

    name = level
    for switch in switches:
        try:
            check(f"{name}+{switch}")
        except ConfigError:
            continue
        name = f"{name}+{switch}"
    return name


def _size(arguments: argparse.Namespace) -> Size:
    from shearline.deploy.studies.dataset import Size  # noqa: PLC0415 - loads zenoh

    return Size(arguments.episodes, arguments.trials, arguments.fresh, arguments.around)


def _gathering(arguments: argparse.Namespace) -> Gathering:
    from shearline.deploy.studies.dataset import Gathering  # noqa: PLC0415 - loads zenoh

    return Gathering(
        study=arguments.out,
        workers=arguments.workers,
        quiet=arguments.json,
        record=not arguments.no_record,
        renew=arguments.renew,
    )


def _plain(found: object) -> Any:
    import msgspec  # noqa: PLC0415 - with the study

    return msgspec.to_builtins(found)


def _finish(
    arguments: argparse.Namespace,
    tables: Sequence[Table],
    gathering: Gathering,
    data: dict[str, Any],
    pictures: Sequence[Path],
) -> None:
    from shearline.studies import tabular  # noqa: PLC0415 - with numpy

    efforts = [
        {"ratio": effort.ratio(trials_s), "trials_s": trials_s, **_plain(effort)}
        for effort, trials_s in gathering.efforts
    ]
    if arguments.json:
        heads = [{"head": head, "rows": rows} for head, rows in tables]
        drawn = [str(path) for path in pictures]
        print(json.dumps({"tables": heads, **data, "efforts": efforts, "pictures": drawn}))
        return
    for head, rows in tables:
        lines = tabular.markdown(head, rows) if arguments.markdown else tabular.aligned(head, rows)
        print("\n".join(["", *lines]))
    for effort in efforts:
        beside = effort["cpu_s"] / effort["evaluators_cpu_s"] - 1.0
        print(
            f"{effort['runs']} runs took {effort['wall_s']:.0f} s, {effort['ratio']:.2f} times the"
            f" least that {effort['lanes']} evaluators need for their trials;"
            f" {effort['cpu_s']:.0f} s of processor time, {100 * beside:.0f} % more than theirs"
        )
    for path in pictures:
        print(f"drawn: {path}")
