"""``shearline study``: the paper's figures and tables as programs."""

from __future__ import annotations

import argparse
import json
import statistics
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shearline.deploy.commands import agreement, claims, section5, switches
from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json, add_plant, at_least, positive
from shearline.protocol.errors import ConfigError

if TYPE_CHECKING:
    from shearline.deploy.studies.fig3 import Found
    from shearline.studies.curves import Curve

LEVELS = ("keylock", "keylock-limit", "keylock-jam")
#: What figure 4 takes; the study itself is not imported before it is asked for.
FUNCTIONS = ("sphere", "rastrigin")
PLACEMENTS = ("centred", "shifted")
DIMENSIONS = (5, 10, 15, 20)
#: A seed of figure 3 whose run is like most: it keeps both peaks.
TYPICAL_SEED = 2


def register(commands: Subparsers) -> None:
    """Add the command and its studies."""
    command = commands.add_parser("study", help="reproduce a figure or table")
    kinds = command.add_subparsers(title="studies", metavar="NAME", required=True)
    _register_fig3(kinds)
    _register_fig4(kinds)
    _register_lock(kinds)
    section5.register(kinds)
    agreement.register(kinds)
    claims.register(kinds)
    switches.register(kinds)


def _register_fig3(kinds: Subparsers) -> None:
    fig3 = kinds.add_parser(
        "fig3",
        help="PSP on two peaks in two dimensions, drawn episode by episode",
        description="Four episodes of 20 trials: samples, decision region, proposals. The problem"
        " as printed has one maximum; narrow bells, which have two, are drawn below it.",
    )
    fig3.add_argument("--learner", choices=("psp-paper", "psp"), default="psp-paper")
    fig3.add_argument("--seed", type=at_least(0), default=TYPICAL_SEED, help="the one drawn")
    fig3.add_argument(
        "--experiments", type=positive, default=20, metavar="M", help="seeds counted, default 20"
    )
    _add_folder(fig3, "fig3")
    add_json(fig3)
    fig3.set_defaults(handler=run_fig3)


def _register_fig4(kinds: Subparsers) -> None:
    fig4 = kinds.add_parser(
        "fig4",
        help="all learners on sphere and Rastrigin, 5 to 20 parameters",
        description="Mean best cost over 10 episodes of 40 trials. Each repeat is one trial of a"
        " run, so that evaluators share the work; killed and started again, only what is missing"
        " is run.",
    )
    fig4.add_argument("--learners", nargs="+", metavar="NAME", help="default: all")
    fig4.add_argument("--functions", nargs="+", choices=FUNCTIONS, default=FUNCTIONS)
    fig4.add_argument("--placements", nargs="+", choices=PLACEMENTS, default=PLACEMENTS)
    fig4.add_argument("--dimensions", nargs="+", type=positive, default=DIMENSIONS, metavar="N")
    fig4.add_argument(
        "--experiments", type=positive, default=50, metavar="M", help="seeds, default 50"
    )
    fig4.add_argument("--workers", type=at_least(0), default=2, metavar="W", help="evaluators")
    fig4.add_argument(
        "--listen", metavar="ENDPOINT", help="where evaluators of other machines may join"
    )
    fig4.add_argument(
        "--renew", action="store_true", help="run again what was made by other code of a learner"
    )
    fig4.add_argument("--markdown", action="store_true", help="print the table as Markdown")
    _add_folder(fig4, "fig4")
    add_json(fig4)
    fig4.set_defaults(handler=run_fig4)


def _register_lock(kinds: Subparsers) -> None:
    lock = kinds.add_parser(
        "lock",
        help="a learner on the key-in-lock, its recommendation tried on fresh noise",
        description="Runs of 10 episodes of 20 trials through the whole system, seed by seed.",
    )
    lock.add_argument("--task", choices=LEVELS, default=LEVELS[0])
    lock.add_argument("--learner", default="psp-ranked")
    lock.add_argument("--experiments", type=positive, default=5, metavar="M")
    lock.add_argument("--first-seed", type=at_least(0), default=0, metavar="S")
    lock.add_argument("--fresh", type=positive, default=100, metavar="N", help="default 100")
    add_plant(lock)
    lock.add_argument("--workers", type=positive, default=2, metavar="W", help="evaluators")
    lock.add_argument(
        "--out",
        type=Path,
        help="folder for the runs; complete ones are kept (default runs/lock-TIME)",
    )
    add_json(lock)
    lock.set_defaults(handler=run_lock)


def _add_folder(study: argparse.ArgumentParser, name: str) -> None:
    """``--out`` and ``--no-picture``: where results and picture go."""
    study.add_argument("--out", type=Path, default=Path("runs", name), help=f"default runs/{name}")
    study.add_argument("--no-picture", action="store_true", help="draw nothing")


def run_fig3(arguments: argparse.Namespace) -> int:
    """Print what each problem's runs found, and draw the first of them."""
    from shearline.deploy.studies.fig3 import PROBLEMS, SWITCHES, find  # noqa: PLC0415 - heavy

    seeds = range(arguments.seed, arguments.seed + arguments.experiments)
    found = []
    for peaks in PROBLEMS:
        found.append(find(peaks, arguments.learner, seeds))
        if not arguments.json:
            print("\n".join(_fig3_lines(found[-1])), flush=True)
    pictures = []
    if not arguments.no_picture:
        from shearline.studies import peaks_picture  # noqa: PLC0415 - with matplotlib

        changed = SWITCHES.get(arguments.learner, {})
        said = ", ".join(
            [
                arguments.learner,
                *(f"{name} = {value}" for name, value in changed.items()),
                f"seed {arguments.seed}",
            ]
        )
        pictures = [arguments.out / "fig3.png"]
        peaks_picture.draw([one.row() for one in found], said, pictures[0])
    _finish(arguments, {"problems": [one.data() for one in found]}, pictures)
    return Exit.OK


def _fig3_lines(found: Found) -> list[str]:
    many = len(found.peaks.maxima) > 1
    held = (
        f"both maxima in {found.kept}, at least one in {found.kept_any}"
        if many
        else f"the maximum in {found.kept}"
    )
    return [
        found.peaks.title,
        *(
            f"  episode {panel.episode + 1}: {panel.good.sum():2d} of {len(panel.u)} samples good,"
            f" {panel.accepted:5.1%} of the square accepted, {panel.regions} region(s)"
            for panel in found.panels
        ),
        f"  of {found.runs} seeds the region holds {held} at the end",
        f"  best reward {statistics.fmean(found.best):.4f} on average",
    ]


def run_fig4(arguments: argparse.Namespace) -> int:
    """Run what is missing, print a line per curve as it is complete, then table and pictures."""
    from shearline.deploy.studies.repeats import gather  # noqa: PLC0415 - loads zenoh
    from shearline.learner.registry import LEARNERS, resolve  # noqa: PLC0415
    from shearline.studies import curves, repeat  # noqa: PLC0415

    if not (arguments.workers or arguments.listen):
        raise ConfigError("nobody would run a repeat: give --workers, or --listen for others")
    learners = list(dict.fromkeys(resolve(name) for name in arguments.learners or LEARNERS))
    if not set(learners) <= set(LEARNERS):
        raise ConfigError(f"a plan does not learn: expected some of {', '.join(LEARNERS)}")
    wanted = repeat.jobs(
        learners,
        functions=arguments.functions,
        placements=[repeat.Placement(name) for name in arguments.placements],
        dimensions=arguments.dimensions,
        seeds=range(arguments.experiments),
    )
    repeats = gather(
        arguments.out,
        wanted,
        workers=arguments.workers,
        listen=arguments.listen,
        renew=arguments.renew,
        quiet=arguments.json,
    )
    found = curves.curves(repeats)
    if not arguments.json:
        lines = curves.markdown(found) if arguments.markdown else curves.table(found)
        print("\n".join(["", *lines]))
    pictures = [] if arguments.no_picture else _draw_fig4(found, arguments.out)
    _finish(arguments, {"curves": _plain(found)}, pictures)
    return Exit.OK


def _draw_fig4(found: list[Curve], folder: Path) -> list[Path]:
    from shearline.studies import curves_picture  # noqa: PLC0415 - with matplotlib

    pictures = []
    for function in dict.fromkeys(curve.function for curve in found):
        pictures.append(folder / f"fig4-{function}.png")
        curves_picture.draw(found, function, pictures[-1])
    return pictures


def _plain(found: list[Curve]) -> Any:
    import msgspec  # noqa: PLC0415 - with the study

    return msgspec.to_builtins(found)


def _finish(arguments: argparse.Namespace, data: dict[str, Any], pictures: list[Path]) -> None:
    """Say where the pictures are: in the data for programs, in lines for people."""
    if arguments.json:
        print(json.dumps({**data, "pictures": [str(path) for path in pictures]}))
        return
    for path in pictures:
        print(f"drawn: {path}")


def run_lock(arguments: argparse.Namespace) -> int:
    """Print one line per experiment as it is done, then the means."""
    from shearline.deploy.studies.lock import experiments  # noqa: PLC0415 - loads zenoh
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
        plant=arguments.plant,
        folder=arguments.out or Path("runs", time.strftime("lock-%Y%m%d-%H%M%S")),
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
