"""Real processes of one run, to be hurt: a learner and evaluators as a user would start them.

When a test fails inside a fleet's block, what the children wrote is added to its failure; when the
block ends, every process of the fleet is gone, or the test fails for that.
"""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any, Self

from chaos.invariants import Audit
from chaos.relay import Relay
from chaos.witness import Witness

from shearline.deploy.observe import Observer
from shearline.deploy.processes import Child, end, spawn, spawn_command
from shearline.learner.dispatcher.entries import AnyEntry, AttemptIssued, ResultTaken
from shearline.learner.dispatcher.observed import history
from shearline.learner.run.journal import read
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.messages import Counted, Message, Status, Verdict

#: Only decides when a broken run is given up; a sound one never waits for it [s].
PATIENCE_S = 90.0

#: A recorder whose learner was killed ends with it; this is many times what that takes [s].
LEAVE_S = 10.0

#: How long a trial may be on its way; less than a lease, after which a victim may be tried again.
ON_ITS_WAY_S = 0.5


class Fleet:
    """One run folder, one endpoint, and the children that use them."""

    def __init__(self, folder: Path, run: list[str]) -> None:
        self.folder = folder
        self.run_dir = folder / "run"
        self.endpoint = free_endpoint()
        self._run = run
        self._children: list[Child] = []
        self._links: list[Witness] = []

    def learner(self, *further: str) -> Child:
        """Start the learner on the run folder; again, if it was killed."""
        where = ["--listen", self.endpoint, "--out", str(self.run_dir)]
        return self._command("learner", ["learner", *self._run, *where, *further])

    def evaluator(self, name: str, *further: str, through: str = "") -> Child:
        """Start one evaluator; ``through`` an endpoint other than the learner's."""
        where = ["--connect", through or self.endpoint, "--name", name]
        return self._command(name, ["evaluator", *where, *further])

    def script(self, name: str, file: str, *arguments: str, at: str = "") -> Child:
        """Start a program of this folder; its first argument is an endpoint, the learner's."""
        path = Path(__file__).with_name(file)
        log = self.folder / f"{name}.out"
        return self._kept(spawn(name, [str(path), at or self.endpoint, *arguments], log))

    def relay(self, name: str) -> Relay:
        """Start a relay in front of the learner."""
        relay = Relay(name, self.endpoint, self.folder / f"{name}.out")
        self._kept(relay.child)
        return relay

    def witness(self) -> Witness:
        """Have what evaluators are told from now on overheard, once there is a learner."""
        witness = Witness(self.endpoint, self.run_dir.name)
        self._links.append(witness)
        return witness

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
        return self.summary()

    def summary(self) -> dict[str, Any]:
        """Return the summary of a run that has ended."""
        summary: dict[str, Any] = json.loads((self.run_dir / "summary.json").read_text())
        return summary

    def entries(self) -> list[AnyEntry]:
        """Return what stands in the journal by now."""
        journal = self.run_dir / "journal"
        return list(read(journal)) if journal.exists() else []

    def rate_hz(self, names: Collection[str], from_s: float, to_s: float) -> float:
        """Return how fast some evaluators' results were counted between two moments [1/s]."""
        told = [c.at_s for c in self.counted() if c.evaluator in names]
        return sum(from_s <= at_s < to_s for at_s in told) / (to_s - from_s)

    def taken_over_s(self, victim: str, at_s: float) -> float:
        """Return when the last trial that a victim held, and never ended, ran elsewhere [s].

        Counted from the moment it was hurt; a result's time less how long it ran is when it began.
        At that very moment it may hold nothing, its next trial still on its way.
        """
        entries = self.entries()
        ended = {e.result.token: e for e in entries if isinstance(e, ResultTaken)}
        held = {
            e.trial
            for e in entries
            if isinstance(e, AttemptIssued)
            and e.evaluator == victim
            and e.at_s <= at_s + ON_ITS_WAY_S
            and (e.token not in ended or ended[e.token].at_s > at_s)
        }
        began_s = [
            e.at_s - e.result.wall_s - at_s
            for e in ended.values()
            if e.verdict is Verdict.COUNTED and e.result.trial in held and e.evaluator != victim
        ]
        assert began_s, f"{victim} held nothing when it was hurt"
        return max(began_s)

    def audit(self) -> Audit:
        """Return the journal of a run that is whole, after it kept every promise."""
        return Audit(self.entries(), whole=True)

    def journal(self) -> list[Message]:
        """Return what the journal says observers should have heard."""
        return list(history(self.entries()))

    def counted(self) -> list[Counted]:
        """Return every outcome in the journal, in order."""
        return [message for message in self.journal() if isinstance(message, Counted)]

    def said(self) -> str:
        """Return what the children wrote, for people."""
        return "\n".join(
            f"{name}: {log.read_text(errors='replace')[-2000:]}"
            for name, log in {child.name: child.log for child in self._children}.items()
            if log.exists()
        )

    def _command(self, name: str, arguments: list[str]) -> Child:
        return self._kept(spawn_command(name, arguments, self.folder / f"{name}.out"))

    def _kept(self, child: Child) -> Child:
        self._children.append(child)
        return child

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _: object, fault: BaseException | None, __: object) -> None:
        for child in self._children:
            if child.returncode is None:
                child.process.send_signal(signal.SIGCONT)
        for link in self._links:
            link.close()
        end(self._children)
        for child in self._children:
            for pipe in (child.process.stdin, child.process.stdout):
                if pipe is not None:
                    pipe.close()
        if fault is not None:
            fault.add_note(self.said())
        else:
            expect_none_left(self.folder)


def counts(trials: int) -> Callable[[Status], bool]:
    """Return the condition that so many trials are counted."""
    return lambda status: status.counted >= trials


def is_busy(name: str) -> Callable[[Status], bool]:
    """Return the condition that an evaluator holds trials."""
    return lambda status: any(e.evaluator == name and e.running for e in status.evaluators)


def is_over(status: Status) -> bool:
    """Tell whether the run has ended."""
    return status.state == "ended"


def expect_none_left(folder: Path) -> None:
    """Assert that no process that mentions a folder outlives what started it by long."""
    end_s = time.monotonic() + LEAVE_S
    while left := processes_in(folder):
        assert time.monotonic() < end_s, left
        os.sched_yield()


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
