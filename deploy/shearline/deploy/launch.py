"""The local launcher: one learner and N evaluators as children, watched until the run ends.

It decides nothing about trials. It starts processes, starts again what died, shows what the
learner says of itself, and leaves nothing behind.
"""

from __future__ import annotations

import json
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from shearline.deploy import processes
from shearline.deploy.exits import Exit
from shearline.deploy.observe import Observer
from shearline.deploy.options import reach
from shearline.deploy.processes import Child, spawn_command
from shearline.protocol.errors import ConfigError, LinkError, RecordError, ShearlineError
from shearline.protocol.messages import CommandKind, Status

#: How often the children are looked after [s]; also how fast a Ctrl-C is noticed.
LOOK_S = 0.2
#: A child that died this often is not started again.
RESTARTS_MAX = 5
#: How long an ended run may take to write its summary and record [s].
ENDING_S = 20.0
#: How long the children have to leave after a Ctrl-C [s].
PATIENCE_S = 6.0


class RunFailed(ShearlineError):  # noqa: N818 - an end, not a mistake of the caller
    """The run ended without a result; the message says why."""


class Show(Protocol):
    """Where people look while a run goes on."""

    def update(self, status: Status) -> None:
        """Draw the latest status."""
        ...

    def say(self, text: str) -> None:
        """Print one line above it."""
        ...


@dataclass(slots=True)
class Launch:
    """A run on this machine.

    Attributes:
        run_dir: The run folder; ``run.toml`` in it says what to run.
        listen: Where the learner listens.
        evaluators: How many to start, 0 or more.
        task: What evaluators load (``file:function``), or ``None`` for the learner's own.
        learner_arguments: Further arguments of ``shearline learner``.
        evaluator_arguments: The same of ``shearline evaluator``.
    """

    run_dir: Path
    listen: str
    evaluators: int
    task: str | None
    learner_arguments: list[str]
    evaluator_arguments: list[str] = field(default_factory=list)
    _show: Show = field(init=False)
    _children: dict[str, Child] = field(default_factory=dict, init=False)
    _restarts: dict[str, int] = field(default_factory=dict, init=False)
    _interrupted: bool = field(default=False, init=False)
    _began_ns: int = field(default=0, init=False)

    def run(self, show: Show) -> dict[str, Any]:
        """Run to the end, or to an orderly stop, and return the summary.

        Args:
            show: Where people look.

        Raises:
            RunFailed: If the learner gave up.
            LinkError: If it could not listen.
            KeyboardInterrupt: If Ctrl-C came before there was anything to sum up.
        """
        self._show = show
        self._began_ns = time.time_ns()
        with _interruptible(self._interrupt):
            try:
                self.run_dir.mkdir(parents=True, exist_ok=True)
                for name in self._names():
                    self._start(name)
                self._watch()
            finally:
                processes.end(self._children.values(), patience_s=PATIENCE_S)
        return self._summary()

    # -- children ------------------------------------------------------------------------------

    def _names(self) -> list[str]:
        return ["learner", *(f"evaluator-{i}" for i in range(self.evaluators))]

    def _arguments(self, name: str) -> list[str]:
        if name == "learner":
            return ["learner", *self.learner_arguments, "--listen", self.listen]
        task = ["--task", self.task] if self.task else []
        more = [*task, *self.evaluator_arguments]
        return ["evaluator", "--connect", reach(self.listen), "--name", name, *more]

    def _start(self, name: str) -> None:
        log = self.run_dir / f"{name}.out"
        self._children[name] = spawn_command(name, self._arguments(name), log)

    def _look_after(self) -> bool:
        """Start again what died; tell whether the run still goes on."""
        learner = self._children["learner"]
        if learner.returncode is not None and learner.returncode >= 0:
            return False  # it ended by itself, well or badly
        for name, child in list(self._children.items()):
            if child.returncode is None:
                continue
            if child.returncode == 0 and name != "learner":
                continue  # it was told that the run is over
            self._restart(name, child)
        return True

    def _restart(self, name: str, child: Child) -> None:
        times = self._restarts[name] = self._restarts.get(name, 0) + 1
        if times > RESTARTS_MAX:
            self._give_up(name, child)
            return
        self._show.say(f"{name} died ({_fate(child)}), started again ({times} of {RESTARTS_MAX})")
        self._start(name)

    def _give_up(self, name: str, child: Child) -> None:
        """Go on without an evaluator; without any, or without the learner, there is no run."""
        del self._children[name]
        text = f"{name} died {RESTARTS_MAX + 1} times ({_fate(child)}): see {child.log}"
        if name == "learner" or len(self._children) == 1:
            raise RunFailed(text)
        self._show.say(text)

    # -- watching ------------------------------------------------------------------------------

    def _watch(self) -> None:
        observer = self._attach()
        if observer is None:
            return
        with observer:
            while self._look_after() and not self._interrupted:
                for status in observer.statuses(LOOK_S):
                    self._show.update(status)
                    if status.state == "ended":
                        self._wait_for_the_end()
                        return
            if self._interrupted:
                observer.command(CommandKind.STOP, "interrupted at the launcher")
                self._wait_for_the_end(PATIENCE_S)

    def _attach(self) -> Observer | None:
        """Connect to our learner; ``None`` if it ended, or we were interrupted, before it spoke."""

        def over() -> bool:
            return self._interrupted or not self._look_after()

        try:
            return Observer.attach(reach(self.listen), timeout_s=None, cancelled=over)
        except LinkError:
            if over():
                return None
            raise

    def _wait_for_the_end(self, patience_s: float = ENDING_S) -> None:
        processes.wait(self._children.values(), patience_s=patience_s)

    def _interrupt(self) -> None:
        self._interrupted = True

    # -- the end -------------------------------------------------------------------------------

    def _summary(self) -> dict[str, Any]:
        """Return what the learner left in its folder in this life of ours."""
        learner = self._children["learner"]
        path = self.run_dir / "summary.json"
        try:
            fresh = path.stat().st_mtime_ns >= self._began_ns
            summary: dict[str, Any] = json.loads(path.read_text()) if fresh else {}
        except FileNotFoundError:
            summary = {}
        except (OSError, ValueError) as error:
            raise RecordError(f"cannot read the summary {path}: {error}") from None
        if learner.returncode in {Exit.OK, Exit.INTERRUPTED} and summary:
            return summary
        if self._interrupted:
            raise KeyboardInterrupt
        raise _failure(learner)


def _failure(learner: Child) -> ShearlineError:
    """Return what the learner said when it gave up, as if it had happened here."""
    said = learner.last_words().removeprefix("shearline: ") or f"the learner: {_fate(learner)}"
    match learner.returncode:
        case Exit.USAGE:
            return ConfigError(said)
        case Exit.NOT_CONNECTED:
            return LinkError(said)
    return RunFailed(said)


@contextmanager
def _interruptible(note: Any) -> Iterator[None]:
    """Turn SIGINT and SIGTERM into a note for the loop; a second one ends this process at once."""

    def handle(*_: object) -> None:
        note()
        for number in previous:
            signal.signal(number, signal.default_int_handler)

    numbers = (signal.SIGINT, signal.SIGTERM)
    previous = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _fate(child: Child) -> str:
    code = child.returncode
    if code is None:
        return "still runs"
    fate = f"exit code {code}" if code >= 0 else f"signal {signal.Signals(-code).name}"
    words = child.last_words()
    return f"{fate}: {words}" if words and code >= 0 else fate


@dataclass(slots=True)
class QuietShow:
    """For programs: nothing on standard output, what happened on standard error."""

    def update(self, status: Status) -> None:
        """Draw nothing."""

    def say(self, text: str) -> None:
        """Print one line."""
        print(f"{time.strftime('%H:%M:%S')} {text}", file=sys.stderr, flush=True)
