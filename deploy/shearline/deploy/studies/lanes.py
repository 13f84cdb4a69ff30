"""Lanes side by side: as many runs at once as there are evaluators, until all are complete.

A lane is one evaluator that stays, and one learner after another at its endpoint. One evaluator
to a run keeps every evaluator busy: where two share a run, one waits at the end of each episode for
the other's trial, and both for the learner. Once no run is left to begin, idle evaluators join one
that goes on. What a run learns does not depend on how many share it.
"""

from __future__ import annotations

import json
import os
import resource
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from shearline.deploy import processes
from shearline.deploy.exits import Exit
from shearline.deploy.launch import LOOK_S, PATIENCE_S, RESTARTS_MAX, RunFailed
from shearline.deploy.options import reach
from shearline.deploy.processes import Child, spawn_command
from shearline.learner.dispatcher.instructions import Ending
from shearline.learner.run.folder import SUMMARY
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import RecordError

#: How long learners whose runs are complete may take to complete their records [s].
LEAVING_S = 20.0
#: Where evaluators of a study write what they have to say.
LOGS = "evaluators"


@dataclass(frozen=True, slots=True)
class Effort:
    """What it took to run what was missing.

    Attributes:
        runs: Runs led.
        wall_s: From the first process started to the last run complete [s].
        evaluators_cpu_s: Processor time of all evaluators, trials for the most part [s].
        cpu_s: Processor time of all that was started, learners among it [s].
        lanes: Evaluators at work at once.
    """

    runs: int
    wall_s: float
    evaluators_cpu_s: float
    cpu_s: float
    lanes: int

    def ratio(self, trials_s: float) -> float:
        """Return the wall time over the least that these evaluators could have taken.

        Args:
            trials_s: Sum of what the trials took by their evaluators' clocks [s]: more than their
                processor time where learners share the cores. Evaluators, on the other hand, do
                more than trials; the lesser of the two counts.
        """
        return self.wall_s * self.lanes / min(trials_s, self.evaluators_cpu_s)


def is_complete(folder: Path) -> bool:
    """Tell whether a run has been led to its end.

    Raises:
        RecordError: If its summary cannot be read.
    """
    path = folder / SUMMARY
    try:
        return path.exists() and json.loads(path.read_text())["state"] == Ending.COMPLETE
    except (OSError, ValueError) as fault:
        raise RecordError(f"cannot read the summary {path}: {fault}") from None


@dataclass(slots=True)
class _Lane:
    """One endpoint, its evaluator, and the run that is led there.

    Attributes:
        number: Of the lane.
        listen: Endpoint of its learners.
        serves: Endpoint that its evaluator connects to: its own, until nothing is left there.
        evaluator: Its evaluator.
        learner: Leads the run that goes on.
        folder: Of that run.
        restarts: How often a process of this run was started again.
        spent_s: Processor time of evaluators that are gone [s].
    """

    number: int
    listen: str
    serves: str
    evaluator: Child | None = None
    learner: Child | None = None
    folder: Path | None = None
    restarts: int = 0
    spent_s: float = 0.0


@dataclass(slots=True)
class Lanes:
    """Leads runs on this machine.

    Attributes:
        study: The study's folder.
        folders: Of the runs, each with its ``run.toml``, none complete.
        workers: Lanes.
        plant: What evaluators act on.
        on_done: Called with each run's folder as it is complete.
    """

    study: Path
    folders: Sequence[Path]
    workers: int
    plant: str
    on_done: Callable[[Path], None]
    _lanes: list[_Lane] = field(default_factory=list, init=False)
    _leaving: list[Child] = field(default_factory=list, init=False)

    def run(self) -> Effort:
        """Lead all runs to their ends and say what it took.

        Raises:
            RunFailed: If a run fails, or processes keep dying.
            KeyboardInterrupt: If it was interrupted; runs were stopped in order and go on later.
        """
        began_s, began_cpu_s, waiting = time.monotonic(), _ended_cpu_s(), deque(self.folders)
        (self.study / LOGS).mkdir(parents=True, exist_ok=True)
        count = min(self.workers, len(self.folders))
        endpoints = [free_endpoint() for _ in range(count)]
        self._lanes = [_Lane(number, own, own) for number, own in enumerate(endpoints)]
        try:
            while waiting or any(lane.folder for lane in self._lanes):
                for lane in self._lanes:
                    self._look_after(lane, waiting)
                time.sleep(LOOK_S / 4)
            wall_s = time.monotonic() - began_s
            evaluators_cpu_s = sum(lane.spent_s + _cpu_s(lane.evaluator) for lane in self._lanes)
            processes.wait(self._leaving, patience_s=LEAVING_S)
        finally:
            processes.end(self.children(), patience_s=PATIENCE_S)
        cpu_s = _ended_cpu_s() - began_cpu_s
        return Effort(len(self.folders), wall_s, evaluators_cpu_s, cpu_s, count)

    def children(self) -> Iterable[Child]:
        """Yield the processes of all lanes, and those that complete a record."""
        yield from self._leaving
        for lane in self._lanes:
            yield from (one for one in (lane.learner, lane.evaluator) if one is not None)

    def _look_after(self, lane: _Lane, waiting: deque[Path]) -> None:
        """Keep the evaluator alive, and lead the next run once one is complete."""
        if lane.evaluator is None or _fell(lane.evaluator, lane):
            lane.evaluator = self._evaluator(lane)
        if lane.folder is not None and lane.learner is not None:
            if is_complete(lane.folder):
                # Its endpoint is free by then; the record may need a moment more.
                self._leaving.append(lane.learner)
                self.on_done(lane.folder)
                lane.folder, lane.learner, lane.restarts = None, None, 0
            elif _fell(lane.learner, lane):
                lane.learner = _learner(lane, lane.folder)
        if lane.folder is None and waiting:
            lane.folder = waiting.popleft()
            lane.learner = _learner(lane, lane.folder)
        elif lane.folder is None:
            self._lend(lane)

    def _lend(self, lane: _Lane) -> None:
        """Have the evaluator of a lane that has no run left join one that goes on."""
        busy = [other.listen for other in self._lanes if other.folder]
        if busy and lane.serves not in busy and lane.evaluator is not None:
            lane.spent_s += _cpu_s(lane.evaluator)
            processes.end([lane.evaluator], patience_s=PATIENCE_S)
            lane.serves = busy[0]
            lane.evaluator = self._evaluator(lane)

    def _evaluator(self, lane: _Lane) -> Child:
        name = f"evaluator-{lane.number}"
        arguments = ["--connect", reach(lane.serves), "--name", name, "--plant", self.plant]
        log = self.study / LOGS / f"{name}.out"
        return spawn_command(name, ["evaluator", *arguments, "--forever", "--no-traces"], log)


def _learner(lane: _Lane, folder: Path) -> Child:
    arguments = ["learner", "--out", str(folder), "--listen", lane.listen]
    return spawn_command(f"learner-{lane.number}", arguments, folder / "learner.out")


def _fell(child: Child, lane: _Lane) -> bool:
    """Tell whether a process was ended by a signal and is to be started again.

    Raises:
        RunFailed: If it ended by itself, which had a reason, or did so too often.
        KeyboardInterrupt: If somebody interrupted it.
    """
    code = child.returncode
    if code is None:
        return False
    if code == Exit.INTERRUPTED:
        raise KeyboardInterrupt
    lane.restarts += 1
    if code >= 0 or lane.restarts > RESTARTS_MAX:
        words = child.last_words().removeprefix("shearline: ")
        raise RunFailed(f"{child.name} ended: {words or 'without a word'} (see {child.log})")
    return True


def _ended_cpu_s() -> float:
    """Return the processor time of all children that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _cpu_s(child: Child | None) -> float:
    """Return the processor time of a living process [s], of all its threads; 0 if it is gone."""
    if child is None:
        return 0.0
    try:
        words = Path(f"/proc/{child.process.pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
