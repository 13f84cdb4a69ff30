"""``shearline replay``: run recorded trials again, to look at them, prove them or ask what if."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from shearline.deploy.exits import Exit
from shearline.deploy.options import PLANTS, Subparsers, add_json, at_least, positive
from shearline.protocol.errors import ConfigError

if TYPE_CHECKING:
    from shearline.evaluator.replay import Replayed
    from shearline.record.reader import Run

T = TypeVar("T")


def register(commands: Subparsers) -> None:
    """Add the command."""
    command = commands.add_parser(
        "replay",
        help="run recorded trials again",
        description="Run recorded trials again: to look at them, to prove them, to ask what if.",
    )
    command.add_argument("run", metavar="RUN_DIR", type=Path)
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--trial", type=at_least(0), metavar="K", help="which trial")
    which.add_argument("--all", action="store_true", help="every trial (with --verify)")
    command.add_argument(
        "--verify", action="store_true", help="prove it comes out again to the last bit, or exit 4"
    )
    what_if = command.add_argument_group("what if")
    what_if.add_argument(
        "--with",
        dest="changes",
        action="extend",
        nargs="+",
        default=[],
        metavar="NAME=VALUE",
        help="another value for a parameter, in its unit",
    )
    what_if.add_argument("--plant", choices=PLANTS, help="another plant than on record")
    what_if.add_argument("--seed", type=at_least(0), metavar="S", help="another seed")
    command.add_argument("--save", metavar="FILE.rrd", type=Path, help="write a file for Rerun")
    command.add_argument("--video", metavar="FILE.mp4", type=Path, help="make a film of the trial")
    command.add_argument(
        "--speed", type=_speed, default=0.25, help="of the film; 1 is real time (default 0.25)"
    )
    command.add_argument("--task", metavar="FILE:FUNCTION", help="your own task, if the run's is")
    command.add_argument("--workers", type=positive, metavar="W", help="processes for --all")
    add_json(command)
    command.set_defaults(handler=replay)


def replay(arguments: argparse.Namespace) -> int:
    """Run one trial again, or verify all."""
    from shearline.record.reader import open_run  # noqa: PLC0415 - mcap loads on use

    _check(arguments)
    run = open_run(arguments.run)
    for sentence in run.damage:
        print(f"shearline: {sentence}", file=sys.stderr)
    return _all(arguments, run) if arguments.all else _one(arguments, run)


def _check(arguments: argparse.Namespace) -> None:
    """Refuse what does not go together."""
    changed = bool(arguments.changes) or arguments.seed is not None
    if arguments.verify and arguments.plant:
        raise ConfigError("a trial is proved on the plant that is on record: leave out --plant")
    if arguments.all and not arguments.verify:
        raise ConfigError("what is to be done with all trials? Add --verify, or name one: --trial")
    if arguments.verify and changed:
        raise ConfigError(
            "a trial that is changed cannot come out the same: leave out --verify, or --with and"
            " --seed"
        )
    if arguments.all and (arguments.save or arguments.video):
        raise ConfigError("--save and --video show one trial: name it with --trial")
    if arguments.workers is not None and not arguments.all:
        raise ConfigError("--workers shares out many trials: add --all, or leave it out")


def _one(arguments: argparse.Namespace, run: Run) -> int:
    """Run one trial again and show it the way that was asked for."""
    from shearline.deploy.replay import words  # noqa: PLC0415 - with what runs trials
    from shearline.deploy.replay.recorded import Recorded, load  # noqa: PLC0415
    from shearline.evaluator.replay import again, change_of, check_ended, judge  # noqa: PLC0415
    from shearline.protocol.space import Space  # noqa: PLC0415

    recorded = Recorded(run)
    name = recorded.task_name(arguments.task)
    case = recorded.case(arguments.trial)
    change = change_of(Space(case.task.space), arguments.changes, arguments.seed)
    if arguments.verify:
        check_ended(case)
    if arguments.video:
        _ready_to_film(name, arguments.video)
    task = load(name, arguments.plant or case.plant)
    replayed = again(task, case, change)
    verified = judge(replayed, task.spec) if case.ended and not change else None
    if not arguments.json:
        print("\n".join(words.lines(replayed, change, verified)))
    elif verified is not None and arguments.verify:
        print(json.dumps(words.verified_json(verified)))
    else:
        print(json.dumps(words.as_json(replayed, change, verified)))
    _show(arguments, run, replayed)
    failed = arguments.verify and verified is not None and not verified.identical
    return Exit.RUN_FAILED if failed else Exit.OK


def _ready_to_film(name: str, path: Path) -> None:
    """Say now rather than after the trial why there can be no film; before mujoco is loaded."""
    from shearline.evaluator.replay import video  # noqa: PLC0415 - with numpy
    from shearline.sims import render  # noqa: PLC0415

    video.check_path(path)
    video.encoder()
    render.choose_backend()
    from shearline.evaluator.replay.film import check_filmable  # noqa: PLC0415

    check_filmable(name)


def _show(arguments: argparse.Namespace, run: Run, replayed: Replayed) -> None:
    """Film it, write it for Rerun, or open the viewer where there is a screen."""
    if arguments.video:
        _film(replayed, arguments.video, arguments.speed)
    if arguments.save:
        from shearline.deploy.replay import show  # noqa: PLC0415 - loads rerun

        show.save(run, replayed, arguments.save)
        _say(f"both recordings are in {arguments.save}: rerun {arguments.save}")
    if arguments.video or arguments.save or arguments.json or arguments.verify:
        return
    from shearline.record.viewer import has_screen  # noqa: PLC0415 - with what runs trials

    if not has_screen():
        _say("no screen here to show it on: --save FILE.rrd or --video FILE.mp4 write a file")
        return
    from shearline.deploy.replay import show  # noqa: PLC0415 - loads rerun

    show.view(run, replayed)


def _film(replayed: Replayed, path: Path, speed: float) -> None:
    from shearline.evaluator.replay import film, video  # noqa: PLC0415 - after choose_backend

    pictures = film.Film(replayed, speed)
    frames = _progress(pictures, len(pictures), "filming")
    seconds = video.write(path, frames, film.WIDTH, film.HEIGHT) / video.FPS
    _say(f"a film of {seconds:.0f} s is in {path}")


def _all(arguments: argparse.Namespace, run: Run) -> int:
    """Verify every trial that can be, and say so in one last line."""
    from shearline.deploy.replay import many, words  # noqa: PLC0415 - with what runs trials
    from shearline.deploy.replay.recorded import Recorded  # noqa: PLC0415

    recorded = Recorded(run)
    name = recorded.task_name(arguments.task)
    left_out = Counter(why for _, why in recorded.unverifiable())
    total = len(run.outcomes) + left_out["never ended"] - left_out.total()
    if total == 0:
        raise ConfigError(f"nothing in {run.run_dir} can be verified: {words.counted(left_out)}")
    workers = min(arguments.workers or os.cpu_count() or 1, total)
    start_s = time.monotonic()
    different = []
    verified = many.verify_all(name, recorded.cases(), workers)
    for one in _progress(verified, total, "verified"):
        if not one.identical:
            different.append(one.trial)
        if arguments.json:
            print(json.dumps(words.verified_json(one)), flush=True)
        elif not one.identical:
            print(words.sentence(one), flush=True)
    summary = words.Summary(
        run=run.name,
        trials=total,
        identical=total - len(different),
        different=different,
        left_out=dict(left_out),
        workers=workers,
        wall_s=time.monotonic() - start_s,
    )
    print(json.dumps(asdict(summary)) if arguments.json else summary)
    return Exit.RUN_FAILED if different else Exit.OK


def _progress(items: Iterable[T], total: int, what: str) -> Iterator[T]:
    """Yield items with a bar on standard error, if a person is looking at it."""
    from rich.console import Console  # noqa: PLC0415 - only where something takes long
    from rich.progress import track  # noqa: PLC0415

    console = Console(stderr=True)
    yield from track(
        items,
        what,
        total=total,
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )


def _say(sentence: str) -> None:
    print(sentence, file=sys.stderr)


def _speed(text: str) -> float:
    """Parse how fast a film goes."""
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.01 <= speed <= 100.0:
        raise argparse.ArgumentTypeError(f"expected a speed from 0.01 to 100, got {text!r}")
    return speed
