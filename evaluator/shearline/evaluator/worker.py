"""The evaluator process: this thread runs trials, the postman's thread speaks to the learner.

Trials run on the main thread, so that signals reach it and simulators that insist on the main
thread get it. The worker never forks and never waits for ever: whoever asked it to leave sees it
gone within a few seconds, if need be by ``os._exit``, or as soon as hardware is let go of in good
order. It does not know how trials are chosen.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import platform
import re
import secrets
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from shearline.evaluator.base import Attended, Task, Trace, TrialAborted
from shearline.evaluator.builtin import builtin_task
from shearline.evaluator.local import Verdict, run_trial
from shearline.evaluator.mail import Beat, Ended, Prepare, Ready, Resting, Run
from shearline.evaluator.mailbox import RENEW_LEASES, Mailbox
from shearline.evaluator.plants import DEFAULT
from shearline.evaluator.postman import End, Exchange, Postman
from shearline.evaluator.showing import TRACE_HZ, Showing
from shearline.evaluator.tasks import FunctionTask
from shearline.protocol.discovery import discover
from shearline.protocol.errors import ConfigError, LinkError, ShearlineError
from shearline.protocol.keys import Keys, check_name
from shearline.protocol.link import open_client
from shearline.protocol.messages import VERSION, Hello, OutcomeKind, Result, Trial, clip
from shearline.protocol.space import Space
from shearline.protocol.switching import quick_switching
from shearline.protocol.task import TaskSpec, digest

log = logging.getLogger(__name__)

#: How long the trial's thread may take to hear that it is over, unless a task says more [s].
FAREWELL_S = 0.3

#: Trials that follow each other faster than this share one line of the log [s].
LOG_EVERY_S = 0.02

#: Longest wait for a session to close [s].
CLOSE_S = 0.5


class TrialStopped(TrialAborted):
    """The worker has to leave, or the trial took too long; raised by ``beat``."""


def default_name(bounds: str | None = None) -> str:
    """Return a name that no other evaluator has: this machine's and this process's.

    A robot's is the same in every process, for its results may outlive one: it ends in the name of
    its bounds file and six digits that stand for where that is.
    """
    host = _plain(platform.node().split(".")[0]) or "host"
    if bounds is None:
        return f"{host[:48]}-{os.getpid()}"
    path = Path(bounds).resolve()
    place = hashlib.sha256(str(path).encode()).hexdigest()[:6]
    return f"{host[:40]}-{_plain(path.stem)[:12] or 'robot'}-{place}"


def _plain(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9-]+", "-", text).strip("-")


@dataclass(frozen=True, slots=True)
class WorkerConfig:
    """How an evaluator takes part.

    Attributes:
        connect: The learner's endpoint, e.g. ``"tcp/192.168.1.5:7447"``.
        name: Unique among the evaluators of a run.
        credits: Attempts held at once: 2 for simulators (one runs, one waits), 1 for a robot.
        plant: What the learner's task acts on here, if it has a plant.
        kind: ``"simulator"``, ``"function"``, ``"robot"``, or ``""`` to tell by the task.
        wait_s: How long to wait for a learner at the start [s], ``None`` for ever.
        forever: Wait for the next run when one ends.
        traces: Offer each trial's trace to observers.
        trace_hz: Samples of a trace per second of the trial's clock, at most.
        settings: Further Zenoh settings by path (TLS).
    """

    connect: str
    name: str = field(default_factory=default_name)
    credits: int = 2
    plant: str = DEFAULT
    kind: str = ""
    wait_s: float | None = 10.0
    forever: bool = False
    traces: bool = True
    trace_hz: float = TRACE_HZ
    settings: Mapping[str, object] = field(default_factory=dict)


def run_worker(
    config: WorkerConfig,
    task: Task | None = None,
    *,
    hard_exit: Callable[[int], object] = os._exit,
) -> End:
    """Take part until the run ends, a signal comes, or something is wrong.

    Args:
        config: How.
        task: What to run; ``None`` takes the built-in task that the learner names.
        hard_exit: Ends the process when a trial neither returns nor beats.

    Returns:
        Exit code (0 run ended, 2 task unusable, 3 no learner, 4 refused or hung, 130 interrupted)
        and one sentence. The caller should end the process with ``os._exit``.

    Raises:
        ConfigError: If the evaluator's name cannot stand in a key, or is not the one under which a
            robot's results are owed.
    """
    return Worker(config, task, hard_exit).run()


class Worker:
    """One evaluator; see :func:`run_worker`."""

    def __init__(
        self, config: WorkerConfig, task: Task | None, hard_exit: Callable[[int], object]
    ) -> None:
        check_name(config.name, "evaluator name")
        self.exchange = Exchange()
        self._config = config
        self._task = task
        self._takes_task = task is None
        self._attended = _attended(task)
        self._run = ""
        self._hard_exit = hard_exit
        self._boot = secrets.token_hex(8)
        self._engine = ""
        self._space: Space | None = None
        self._showing = Showing(config.trace_hz)
        self._warm = False
        self._over: set[tuple[str, int]] = set()
        self._parted = threading.Event()
        self._beat_s = 0.0
        self._deadline_s = 0.0
        self._log_s = 0.0
        self._unsaid = 0

    def run(self) -> End:
        """Run trials until the end."""
        if self._attended is not None:
            name = self._config.name
            self._attended.join(name, self._be_ready, self.exchange.leave, self._look)
            self.exchange.settled = self._attended.spool.drop
        network = threading.Thread(target=self._network, daemon=True, name="postman")
        with _signals(self.exchange), quick_switching():
            network.start()
            if self._task is not None:
                self._prepare(self._task)
            while True:
                job = self.exchange.next_job()
                match job:
                    case Run(trial):
                        self._try(trial)
                    case Prepare(task):
                        self._take(task)
                    case End():
                        self._parted.set()
                        network.join(FAREWELL_S)
                        if self._attended is not None:
                            self._attended.close()
                        return job

    # -- the trial's thread ------------------------------------------------------------------

    def _prepare(self, task: Task) -> None:
        """Warm a task, then say so."""
        try:
            task.warm()
            self._engine = clip(task.engine)
        except ConfigError as fault:
            self.exchange.leave(2, str(fault))
        except ShearlineError as fault:
            self.exchange.leave(3 if isinstance(fault, LinkError) else 4, str(fault))
        except ModuleNotFoundError as fault:
            why = f"task {task.spec.name} needs {fault.name}, which is not installed here"
            self.exchange.leave(2, f"{why}: pip install 'shearline[all]' brings all that is needed")
        except Exception as fault:
            log.debug("warming failed", exc_info=True)
            why = f"task {task.spec.name} cannot start here: {type(fault).__name__}: {fault}"
            self.exchange.leave(4, why)
        else:
            self._task, self._space = task, Space(task.spec.space)
            if self._attended is None:
                self._warm = True
                self.exchange.put(Ready(self._engine, digest(task.spec)))

    def _be_ready(self, ready: bool) -> None:  # noqa: FBT001 - it is what the method is about
        """Hear from a task on hardware whether trials may come; called from any thread."""
        assert self._task is not None
        self._warm = ready
        if ready:
            self._engine = clip(self._task.engine)
            self.exchange.put(Ready(self._engine, digest(self._task.spec)))
        else:
            self.exchange.put(Resting())

    def _look(self) -> tuple[bool, bool]:
        """Tell a task on hardware whether the learner can be reached, and whether it holds."""
        return self.exchange.is_linked, not self.exchange.is_open

    def _take(self, spec: TaskSpec) -> None:
        """Take the learner's task, if it is a built-in that means the same here."""
        if self._task is not None and digest(self._task.spec) == digest(spec):
            self.exchange.put(Ready(self._engine, digest(spec)))
            return
        try:
            task = builtin_task(spec.name, self._config.plant)
        except ConfigError:
            self.exchange.leave(
                2, f"the run learns {spec.name!r}, which is no built-in: name it with --task"
            )
            return
        if digest(task.spec) != digest(spec):
            why = f"the learner's {spec.name!r} has other bounds or options than the one here"
            self.exchange.leave(4, f"{why}: install the same Shearline on both sides")
            return
        self._prepare(task)

    def _try(self, trial: Trial) -> None:
        """Run one attempt and report how it ended."""
        exchange = self.exchange
        assert self._task is not None
        if exchange.abort_why:
            verdict = Verdict(OutcomeKind.ABORTED, why=f"not begun: {exchange.abort_why}")
        else:
            exchange.running = trial.token
            self._deadline_s = time.monotonic() + trial.deadline_s
            if self._attended is not None:
                self._attended.announce(self._run, trial)
            verdict = run_trial(self._task, trial.theta, trial.seed, self._beat, self._space)
            exchange.running = ""
        if self._attended is not None and not self._warm:
            exchange.tell(Resting())  # first, or the learner hands out the next one at once
        exchange.tell(Ended(self._result(trial, verdict)))
        self._log(trial, verdict)
        if self._config.traces and verdict.trace is not None:
            self._show(verdict.trace, trial)

    def _show(self, trace: Trace, trial: Trial) -> None:
        """Offer what happened to observers; what they miss is no concern of the trial's."""
        now_s = time.monotonic()
        try:
            for message in self._showing.messages(
                self._task, trace, trial.trial, trial.token, now_s
            ):
                self.exchange.put(message)
        except ValueError as fault:
            log.warning("the trace of trial %d is malformed: %s", trial.trial, fault)

    def _log(self, trial: Trial, verdict: Verdict) -> None:
        """Write a line for a trial, but not for each of thousands a second."""
        self._unsaid += 1
        now_s = time.monotonic()
        if now_s < self._log_s:
            return
        among = f" (one of {self._unsaid})" if self._unsaid > 1 else ""
        self._unsaid, self._log_s = 0, now_s + LOG_EVERY_S
        text = "trial %d: %s %.6g %s%s"
        log.info(text, trial.trial, verdict.kind, verdict.cost, verdict.why, among)

    def _beat(self) -> None:
        """Renew the leases now and then; end the trial if it has to end."""
        if self.exchange.abort_why:
            raise TrialStopped(self.exchange.abort_why)
        now_s = time.monotonic()
        if now_s > self._deadline_s:
            raise TrialStopped("ran longer than its deadline")
        if now_s >= self._beat_s:
            self._beat_s = now_s + RENEW_LEASES * self.exchange.lease_s
            self.exchange.put(Beat())

    def _result(self, trial: Trial, verdict: Verdict) -> Result:
        return Result(
            boot=self._boot,
            token=trial.token,
            trial=trial.trial,
            kind=verdict.kind,
            cost=verdict.cost,
            seed=trial.seed,
            engine=self._engine,
            digest=verdict.digest,
            wall_s=verdict.wall_s,
            why=clip(verdict.why),
            extras=dict(verdict.extras),
        )

    # -- the postman's thread ------------------------------------------------------------------

    def _network(self) -> None:
        """Serve runs, then see that the trial's thread hears of the end or the process ends."""
        try:
            end = self._serve()
            while end.code == 0 and self._config.forever and not self.exchange.is_leaving():
                log.info("%s; waiting for the next run", end.why)
                end = self._serve()
        except LinkError as fault:
            end = End(3, str(fault))
        except Exception:
            log.exception("the postman failed")
            end = End(4, "this evaluator failed: its log says how")
        leaving = self.exchange.leaving
        if leaving is not None:
            end = End(leaving.code, leaving.why)
        self.exchange.finish(end)
        attended = self._attended
        if not self._parted.wait(FAREWELL_S if attended is None else attended.farewell_s):
            log.warning("%s; the trial does not come back, so the process ends", end.why)
            if attended is not None:
                attended.close()
            self._hard_exit(end.code)

    def _serve(self) -> End:
        """Take part in one run, from finding its learner to its end."""
        config, exchange = self._config, self.exchange
        exchange.renew()
        wait_s = None if self._over else config.wait_s
        link = open_client(
            config.connect, wait_s, cancelled=exchange.is_leaving, settings=config.settings
        )
        try:
            run, epoch = discover(link, wait_s, cancelled=exchange.is_leaving, besides=self._over)
            log.info("connected to %s, run %s", config.connect, run)
            self._run = run
            mailbox = self._mailbox(run)
            end = Postman(exchange, link, Keys(run), config.name, mailbox).serve(epoch)
            self._over.add((run, mailbox.epoch or epoch))
            return end
        finally:
            link.close(CLOSE_S)

    def _mailbox(self, run: str) -> Mailbox:
        own = None if self._takes_task else self._task
        function = isinstance(own, FunctionTask)
        attended = self._attended
        kind = "function" if function else "simulator" if attended is None else attended.kind
        hello = Hello(
            boot=self._boot,
            version=VERSION,
            task_digest="" if own is None else digest(own.spec),
            kind=self._config.kind or kind,
            engine=self._engine,
            credits=self._config.credits if attended is None else 1,
        )
        warm = self._warm and own is not None
        keeps = attended is not None
        mailbox = Mailbox(hello, takes_task=own is None, pulses=function, keeps=keeps, warm=warm)
        if attended is not None:
            mailbox.farewell_s = attended.farewell_s
            mailbox.owe(attended.spool.pending(run))
        return mailbox


def _attended(task: object) -> Attended | None:
    return task if isinstance(task, Attended) else None


@contextlib.contextmanager
def _signals(exchange: Exchange) -> Iterator[None]:
    """Leave on the first SIGINT or SIGTERM, at once on the second."""

    def leave(number: int, _frame: object) -> None:
        if exchange.is_leaving():
            os._exit(130)
        exchange.leave(130, f"interrupted by {signal.Signals(number).name}")

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {n: signal.signal(n, leave) for n in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
