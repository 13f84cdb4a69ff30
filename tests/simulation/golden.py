"""Golden journals: written once by real runs, read again by every version that follows.

``PYTHONPATH=tests python -m simulation.golden tests/learner/dispatcher/golden`` leads runs over
the real network with light evaluators and writes, where they are missing, each run's journal and
the state it leads to. A file that is there is never written again: it stands for runs that users
have.
"""

from __future__ import annotations

import itertools
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import msgspec
from simulation.light import LightEvaluator, succeed

from shearline.learner.dispatcher import Book
from shearline.learner.run.config import RunConfig
from shearline.learner.run.folder import JOURNAL
from shearline.learner.run.journal import read
from shearline.learner.run.serving import serve
from shearline.protocol.codec import encode
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.keys import Keys
from shearline.protocol.link import open_client
from shearline.protocol.messages import Command, CommandKind, OutcomeKind, Trial
from shearline.protocol.task import TaskSpec

TASK = TaskSpec(name="ball", space={"x": ("m", -1.0, 1.0), "y": ("m", -1.0, 1.0)}, trial_s=5.0)
CONFIG = RunConfig(task=TASK, learner="lhs", episodes=3, trials=4, seed=1, record=False)

Answer = Callable[[Trial], tuple[OutcomeKind, float, str]]


def state_of(book: Book) -> object:
    """Return everything a book says, as plain values."""
    assert book.opened is not None
    facts = {
        "run": book.opened.run,
        "epoch": book.epoch,
        "held": book.held,
        "ended": book.ended,
        "tally": book.tally,
        "closed": book.closed,
        "told": book.told,
        "untold": book.untold,
        "pending": list(book.pending),
        "trials": list(book.trials.values()),
        "attempts": list(book.attempts.values()),
    }
    return msgspec.to_builtins(facts)


def smooth(folder: Path) -> None:
    """A run that nothing disturbs."""
    _lead(CONFIG, folder, succeed)


def rough(folder: Path) -> None:
    """A run with aborts, a rejection, an evaluator that dies, and lost trials."""
    counter = itertools.count()

    def answer(trial: Trial) -> tuple[OutcomeKind, float, str]:
        number = next(counter)
        if trial.trial == 5:
            return OutcomeKind.ABORTED, 0.0, "user stop"
        if number == 2:
            return OutcomeKind.REJECTED, 0.0, "out of reach"
        return succeed(trial)

    _lead(CONFIG, folder, answer, dies=True)


def interrupted(folder: Path) -> None:
    """A run of psp that is held, resumed, stopped and led to its end by another learner."""
    endpoint, config = free_endpoint(), msgspec.structs.replace(CONFIG, learner="psp")
    done = itertools.count(1)

    def answer(trial: Trial) -> tuple[OutcomeKind, float, str]:
        commands = {3: (CommandKind.HOLD, CommandKind.RESUME), 6: (CommandKind.STOP,)}
        with open_client(endpoint) as link:
            for kind in commands.get(next(done), ()):
                link.publish(Keys(folder.name).op_cmd(), encode(Command(kind=kind, why="golden")))
        return succeed(trial)

    _lead(config, folder, answer, endpoint)
    _lead(config, folder, succeed, endpoint)


RUNS: Mapping[str, Callable[[Path], None]] = {
    "smooth": smooth,
    "rough": rough,
    "interrupted": interrupted,
}


def _lead(
    config: RunConfig, folder: Path, answer: Answer, endpoint: str = "", *, dies: bool = False
) -> None:
    endpoint = endpoint or free_endpoint()
    lights = [LightEvaluator(endpoint, "a", answer), LightEvaluator(endpoint, "b", answer)]
    if dies:
        lights.append(LightEvaluator(endpoint, "c", answer, last=1))
    for light in lights:
        light.start()
    serve(config, folder, endpoint)
    for light in lights:
        light.join(10.0)


def main(into: Path) -> None:
    """Write what is missing."""
    into.mkdir(parents=True, exist_ok=True)
    for name, lead in RUNS.items():
        journal = into / f"{name}.journal"
        if journal.exists():
            continue
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch, name)
            lead(folder)
            journal.write_bytes((folder / JOURNAL).read_bytes())
        state = state_of(Book.of(read(journal)))
        text = msgspec.json.format(msgspec.json.encode(state), indent=1).decode()
        journal.with_suffix(".json").write_text(text + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
