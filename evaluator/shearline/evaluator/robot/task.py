"""The robot as a task of the worker: asks the arm's process, and notices when it falls silent.

Nothing in this process, which is on the network, can move, arm or recover the arm.
"""

from __future__ import annotations

import contextlib
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from queue import Empty, SimpleQueue

import msgspec
import numpy as np

from shearline.evaluator.base import Array, Outcome, Trace, TrialAborted, TrialRejected
from shearline.evaluator.keylock_spec import keylock_spec
from shearline.evaluator.robot import pipe
from shearline.evaluator.robot.bounds import read_bounds
from shearline.evaluator.robot.process import Orders, folder_of
from shearline.evaluator.robot.spool import Spool
from shearline.protocol.errors import ConfigError, LinkError, ShearlineError
from shearline.protocol.messages import OutcomeKind, TraceData, Trial
from shearline.protocol.task import TaskSpec

#: How often the trial's thread beats while the arm works [s].
BEAT_S = 0.05

#: An arm's process that starts may need so long for imports, the robot's connection and, the first
#: time on a computer, the compiler [s].
START_S = 180.0

#: A stopped arm that is alive may take so long up the ladder and back to the start pose [s].
FAREWELL_S = 60.0

#: Looks without a sign of life after which the arm's process is frozen. Looks are counted, not
#: seconds: this process may have been frozen itself.
DEAF_LOOKS = round(pipe.SILENCE_S / pipe.PULSE_S)


class RobotDown(ShearlineError):  # noqa: N818 - a state, not a mistake
    """The arm's process is gone or frozen; only an operator helps."""


def start_process(
    orders: Orders, terminal: int | None = None
) -> tuple[subprocess.Popen[bytes], pipe.Pipe]:
    """Spawn the arm's process on a terminal; return it and our end of the pipe.

    Args:
        orders: What a person typed.
        terminal: What the process reads the operator from; ``None`` for our own standard input.
    """
    theirs_read, ours_write = os.pipe()
    ours_read, theirs_write = os.pipe()
    text = msgspec.json.encode(
        msgspec.structs.replace(orders, read=theirs_read, write=theirs_write)
    )
    process = subprocess.Popen(  # noqa: S603 - our own interpreter with our own module
        [sys.executable, "-m", "shearline.evaluator.robot.process", text.decode()],
        stdin=terminal,
        pass_fds=(theirs_read, theirs_write),
    )
    os.close(theirs_read)
    os.close(theirs_write)
    return process, pipe.Pipe(ours_read, ours_write)


class RobotTask:
    """A robot in front of a lock; see :class:`shearline.evaluator.base.Task` and ``Attended``.

    Args:
        orders: What a person typed.
        terminal: What the arm's process reads the operator from; ``None`` for our standard input.

    Raises:
        ConfigError: If there is no such level, or the bounds file is not sound.
    """

    kind = "robot"
    farewell_s = FAREWELL_S

    def __init__(self, orders: Orders, terminal: int | None = None) -> None:
        self._orders = orders
        self._terminal = terminal
        self._spec = keylock_spec(orders.task)
        read_bounds(Path(orders.bounds))  # before a folder is made beside a file that is not there
        self.spool = Spool(folder_of(Path(orders.bounds)) / "spool")
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: pipe.Pipe | None = None
        self._answers: SimpleQueue[pipe.Answer] = SimpleQueue()
        self._heard = threading.Event()
        self._stands = threading.Event()
        self._engine = ""
        self._over: pipe.Over | None = None
        self._trial: Trial | None = None
        self._run = self._name = ""
        self._say_ready: Callable[[bool], None] = lambda _ready: None
        self._say_over: Callable[[int, str], None] = lambda _code, _why: None
        self._look: Callable[[], tuple[bool, bool]] = lambda: (True, False)

    @property
    def spec(self) -> TaskSpec:
        """Name, space and options."""
        return self._spec

    @property
    def engine(self) -> str:
        """Fingerprint of robot, bounds and skill; known once warm."""
        return self._engine

    # -- attended --------------------------------------------------------------------------------

    def join(
        self,
        name: str,
        ready: Callable[[bool], None],
        over: Callable[[int, str], None],
        look: Callable[[], tuple[bool, bool]],
    ) -> None:
        """Be told how to say that trials may come, that all is over, and what the link does.

        Raises:
            ConfigError: If results are owed under another name.
        """
        self.spool.expect(name)
        self._name = name
        self._say_ready, self._say_over, self._look = ready, over, look

    def announce(self, run: str, trial: Trial) -> None:
        """Be told which attempt the next :meth:`run` is for."""
        self._run, self._trial = run, trial

    # -- task ------------------------------------------------------------------------------------

    def warm(self) -> None:
        """Start the arm's process and wait until the robot is connected.

        Raises:
            ConfigError: If what was ordered cannot be done.
            LinkError: If nobody answers at the robot's address.
            RobotDown: If the robot refuses.
        """
        self._process, self._pipe = start_process(self._orders, self._terminal)
        threading.Thread(target=self._listen, daemon=True, name="arm").start()
        self._stands.wait(START_S)
        over = self._over
        if over is not None:
            self.close()
            raise {2: ConfigError, 3: LinkError}.get(over.code, RobotDown)(over.why)
        if not self._engine:
            self._process.kill()
            raise RobotDown(f"the arm's process said nothing for {START_S:g} s")
        self.spool.own(self._name)  # not before: now the folder is this robot's and nobody else's
        threading.Thread(target=self._pulse, daemon=True, name="pulse").start()

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:  # noqa: ARG002
        """Have the arm run the attempt announced; see :class:`shearline.evaluator.base.Task`.

        Raises:
            TrialAborted: If no verdict was reached.
            TrialRejected: If the lab's bounds do not allow the tuple.
        """
        trial = self._trial
        assert trial is not None, "announce() comes first"
        self._say(pipe.Try(run=self._run, trial=trial))
        try:
            answer = self._wait(trial.token, beat)
        except TrialAborted:
            kept = [r for r in self.spool.pending(self._run) if r.token == trial.token]
            if not kept:
                raise
            answer = pipe.Answer(result=kept[0])  # measured, though nobody was left to say it
        return outcome_of(answer)

    def close(self) -> None:
        """Have the arm's process bring the key out and end; wait until it has.

        Its terminal is this process's too: the operator can type ``stop`` as long as this one is
        there. An arm's process that falls silent is ended by the thread that hears it.
        """
        self._say(pipe.Leave(why="the worker leaves"))
        if self._process is not None:
            self._process.wait()

    def _wait(self, token: str, beat: Callable[[], None]) -> pipe.Answer:
        """Wait for the arm's answer; once ``beat`` raises, stop the arm and wait on."""
        stopped: TrialAborted | None = None
        end_s = math.inf
        while time.monotonic() < end_s:
            with contextlib.suppress(Empty):
                answer = self._answers.get(timeout=BEAT_S)
                if answer.result.token == token:
                    return answer
                continue
            if self._over is not None:
                raise TrialAborted(f"{self._over.why}; the key may be in the lock")
            if stopped is None:
                try:
                    beat()
                except TrialAborted as why:
                    stopped, end_s = why, time.monotonic() + FAREWELL_S
                    self._say(pipe.Stop(token=token, why=str(why)))
        assert stopped is not None
        raise stopped

    def _end(self, code: int, why: str) -> None:
        if self._over is None:
            self._over = pipe.Over(code=code, why=why)
            self._stands.set()
            self._say_ready(False)  # noqa: FBT003 - as the worker wants it
            self._say_over(code, why)

    def _say(self, message: pipe.Say) -> None:
        with contextlib.suppress(OSError):
            if self._pipe is not None:
                self._pipe.send(message)

    def _pulse(self) -> None:
        """Tell the arm's process that this one lives, and how its link is; end a frozen one."""
        deaf = 0
        while self._over is None:
            linked, held = self._look()
            self._say(pipe.Look(linked=linked, held=held))
            deaf = 0 if self._heard.is_set() else deaf + 1
            self._heard.clear()
            if deaf > DEAF_LOOKS:
                assert self._process is not None
                # Its client gone, the robot stops by itself; thawed, it might go on.
                self._process.kill()
                silent = f"has been silent for {pipe.SILENCE_S:g} s"
                self._end(4, f"the arm's process {silent} and was ended")
            time.sleep(pipe.PULSE_S)

    def _listen(self) -> None:
        """Hear the arm's process, to its end."""
        assert self._pipe is not None
        try:
            while True:
                data = self._pipe.receive()
                assert data is not None
                self._hear(msgspec.msgpack.decode(data, type=pipe.FromArm))
        except (EOFError, OSError, msgspec.MsgspecError):
            self._end(4, "the arm's process has died")

    def _hear(self, message: pipe.Pulse | pipe.Stands | pipe.Answer | pipe.Over) -> None:
        self._heard.set()
        match message:
            case pipe.Stands(engine=engine, takes=takes):
                self._engine = engine
                self._stands.set()
                self._say_ready(takes)
            case pipe.Answer():
                self._answers.put(message)
            case pipe.Over(code=code, why=why):
                self._end(code, why)
            case _:
                pass


def outcome_of(answer: pipe.Answer) -> Outcome:
    """Return what the arm answered as a task returns it.

    Raises:
        TrialAborted: If there is no verdict.
        TrialRejected: If the lab does not allow the tuple.
    """
    result = answer.result
    if result.kind is OutcomeKind.REJECTED:
        raise TrialRejected(result.why)
    if result.kind is OutcomeKind.ABORTED:
        raise TrialAborted(result.why)
    return Outcome(
        cost=result.cost,
        success=result.kind is OutcomeKind.SUCCESS,
        digest=result.digest,
        extras=result.extras,
        why=result.why,
        trace=None if answer.trace is None else _trace(answer.trace),
    )


def _trace(data: TraceData) -> Trace:
    columns = np.frombuffer(data.data, dtype="<f4").reshape(len(data.names), data.samples)
    named = zip(data.names[1:], data.units[1:], columns[1:], strict=True)
    return Trace(
        t_s=columns[0],
        columns={name: (unit, values) for name, unit, values in named},
        events=tuple(data.events),
        placed=tuple(data.placed),
    )
