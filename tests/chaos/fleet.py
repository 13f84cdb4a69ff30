"""Real processes of one run, to be hurt: a learner and evaluators as a user would start them."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Self

from shearline.deploy.observe import Observer
from shearline.deploy.processes import Child, end, spawn_command
from shearline.learner.dispatcher.observed import history
from shearline.learner.journal import read
from shearline.protocol.link import free_endpoint
from shearline.protocol.messages import Counted, Message, Status

#: Only decides when a broken run is given up; a sound one never waits for it [s].
PATIENCE_S = 90.0


class Fleet:
    """One run folder, one endpoint, and the children that use them."""

    def __init__(self, folder: Path, run: list[str]) -> None:
        self.folder = folder
        self.run_dir = folder / "run"
        self.endpoint = free_endpoint()
        self._run = run
        self._children: list[Child] = []

    def learner(self, *further: str) -> Child:
        """Start the learner on the run folder; again, if it was killed."""
        return self._spawn(
            "learner",
            [
                "learner",
                *self._run,
                "--listen",
                self.endpoint,
                "--out",
                str(self.run_dir),
                *further,
            ],
        )

    def evaluator(self, name: str, *further: str) -> Child:
        """Start one evaluator."""
        return self._spawn(
            name, ["evaluator", "--connect", self.endpoint, "--name", name, *further]
        )

    def statuses(self) -> Iterator[Status]:
        """Yield what the learner says of itself until it ends."""
        end_s = time.monotonic() + PATIENCE_S
        with Observer.attach(self.endpoint, timeout_s=PATIENCE_S) as observer:
            while time.monotonic() < end_s:
                yield from observer.statuses(1.0)
        raise AssertionError(f"the run did not get anywhere in {PATIENCE_S:g} s: {self.said()}")

    def when(self, condition: Callable[[Status], bool]) -> Status:
        """Return the first status that fulfils a condition."""
        return next(status for status in self.statuses() if condition(status))

    def outcome(self, learner: Child) -> dict[str, Any]:
        """Wait for the learner to end and return its summary."""
        code = learner.process.wait(PATIENCE_S)
        assert code == 0, self.said()
        summary: dict[str, Any] = json.loads((self.run_dir / "summary.json").read_text())
        return summary

    def journal(self) -> list[Message]:
        """Return what the journal says observers should have heard."""
        return list(history(read(self.run_dir / "journal")))

    def counted(self) -> list[Counted]:
        """Return every outcome in the journal, in order."""
        return [message for message in self.journal() if isinstance(message, Counted)]

    def said(self) -> str:
        """Return what the children wrote, for people."""
        return "\n".join(
            f"{c.name}: {c.log.read_text(errors='replace')[-2000:]}" for c in self._children
        )

    def _spawn(self, name: str, arguments: list[str]) -> Child:
        child = spawn_command(name, arguments, self.folder / f"{name}.out")
        self._children.append(child)
        return child

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for child in self._children:
            if child.returncode is None:
                child.process.send_signal(signal.SIGCONT)
        end(self._children)


def processes_in(folder: Path) -> list[str]:
    """Return the command lines of living processes that mention a folder."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit() or int(entry.name) == os.getpid():
            continue
        try:
            command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()
            state = (entry / "stat").read_text().rsplit(")", 1)[1].split()[0]
        except OSError:
            continue  # it ended while we looked
        if str(folder) in command and state != "Z":
            found.append(command)
    return found
