"""The arm as a machine: events from terminal and pipe in, motions through the port out.

One thread owns port, state and skill. It moves only in the states of :data:`MOVING`, enters them
only from a state that an operator armed, and leaves a broken one only by an operator's word. What
trials there are, it is told; what they are worth, nobody here decides.
"""

from __future__ import annotations

import time
from collections import OrderedDict
from dataclasses import replace
from queue import Empty
from typing import Any

import numpy as np

from shearline.evaluator.robot import pipe
from shearline.evaluator.robot.errors import Ending, MotionEnded, RobotError, RobotRefused
from shearline.evaluator.robot.motions import FAULTS, PATIENCE_S, Mover
from shearline.evaluator.robot.peer import Gone
from shearline.evaluator.robot.port import Array
from shearline.evaluator.robot.results import Cell, Ran, result_of
from shearline.evaluator.robot.spool import Spool
from shearline.evaluator.robot.states import STUCK, Cause, State
from shearline.evaluator.robot.store import worn
from shearline.evaluator.robot.terminal import STOP, Closed, Line, consent
from shearline.evaluator.robot.trial import Report, Work, warm
from shearline.protocol.messages import OutcomeKind

#: Share of the lab's speeds in the rehearsal after arming.
SLOW = 0.2

#: How often the robot is looked at while nothing happens [s].
IDLE_S = 0.1

#: What moves the arm, or lets it move, and so must answer what was asked last.
CONSENTS = frozenset({"confirm", "recover", "replaced key", "replaced lock"})

#: Attempts whose answer is remembered, so that the same one twice is one motion.
ANSWERS_MAX = 64

#: The canary fails so often in a row before key and lock count as worn.
CANARIES = 2


class Arm(Mover):
    """A mover, and those who ask it: the operator, the worker, and the care for key and lock.

    Args:
        step: Ask the operator before every trial.
        facts: As for :class:`Mover`.
    """

    def __init__(self, *, step: bool = False, **facts: Any) -> None:
        super().__init__(**facts)
        self.inbox = self._terminal.inbox
        self._step = step
        self._spool = Spool(self._store.folder / "spool")
        self._answers: OrderedDict[str, pipe.Answer] = OrderedDict()
        self._paused_here = False

    # -- the loop --------------------------------------------------------------------------------

    def serve(self) -> pipe.Over:
        """Take part until the worker, the operator or a signal ends it."""
        self.begin()
        self._terminal.start()
        while True:
            try:
                item = self.inbox.get(timeout=IDLE_S)
            except Empty:
                item = None
            over = self.handle(item)
            if over is not None:
                return over

    def begin(self) -> None:
        """Stand there, connected, and ask the operator.

        The skill is loaded first: whoever is armed must be able to hear ``stop`` at any moment.
        """
        warm(self._work(self._bounds.canary_tuple(), 1.0))
        self._enter(Cause.OPENED, "connected; nothing moves before you confirm")
        self._prompt()

    def handle(self, item: object) -> pipe.Over | None:
        """Act upon one thing that came, or upon nothing; return how it ended, if it did."""
        self.alive()
        try:
            over = self._act(item)
            if over is None:
                self._idle()
        except FAULTS as fault:
            self._break(fault)
            return None
        return over

    def _act(self, item: object) -> pipe.Over | None:
        match item:
            case pipe.Try():
                self._answer(item)
            case Line(text, at_s):
                return self._typed(text, at_s)
            case Closed():
                return self._leave("the terminal is gone: nobody could stop or recover the arm")
            case Gone():
                return self._leave("the worker is gone")
            case pipe.Leave(why=why):
                return self._leave(why)
            case _:
                pass
        return None

    def _leave(self, why: str) -> pipe.Over:
        armed = self.state not in STUCK
        if armed and self.state is not State.OFFLINE:
            self._enter(Cause.CLOSE, why)
        return pipe.Over(code=0 if armed else 4, why=why)

    def _idle(self) -> None:
        """Look at the robot between trials, and follow the learner's hold.

        Raises:
            MotionEnded: If it stopped, cannot be trusted, or somebody leads it though it is armed.
        """
        if self.state in STUCK or self.state is State.OFFLINE:
            return
        if self.state is State.IDLE:
            self._watch.look()
        else:
            self._must_be_left()
        held = self.peer.held or self._paused_here
        if held and self.state is State.READY:
            self._enter(Cause.PAUSE, "no trial is taken")
        elif not held and self.state is State.PAUSED:
            self._enter(Cause.RESUME, "trials are taken again")
        self._care()

    # -- the operator ----------------------------------------------------------------------------

    def _typed(self, word: str, at_s: float) -> pipe.Over | None:
        self._store.note("typed", word=word[:80], state=self.state)
        if word in CONSENTS and at_s < self._asked_s:
            self._terminal.say(f"'{word}' was typed before this was asked, and does not count")
            self._prompt()
            return None
        match word, self.state:
            case "quit", _:
                return self._leave("ended by the operator")
            case "pause" | "resume", State.READY | State.PAUSED:
                self._paused_here = word == "pause"
            case "confirm", State.IDLE:
                self._arm()
            case "confirm", State.READY if not self._rehearsed:
                self._rehearse()
            case "recover", State.HOLD | State.FAULT | State.JAMMED:
                self._recover()
            case (("replaced key" | "replaced lock"), State.WORN):
                self._replaced(word.split()[1])
            case word, _ if word == STOP:
                self._break(MotionEnded(Ending.STOPPED, "stopped by the operator"))
            case _:
                self._prompt()
        return None

    def _arm(self) -> None:
        """An operator confirmed: bring the key out if need be, rehearse slowly, take trials."""
        if why := worn(self._store.wear(), self._bounds.wear):
            self._enter(Cause.WEAR, why)
            return
        self.alive(PATIENCE_S)  # tares
        self._watch.refresh()
        self._must_stand()
        try:
            with self._watch.blocked():  # a jammed key's pull is no zero
                self._port.set_guard(self._bounds.port_guard(), tare=not self._store.key_in_lock)
        except RobotRefused as refused:
            self._terminal.say(f"not armed: {refused}")
            self._prompt()
            return
        self._store.note("armed", bounds=self._bounds.hash, engine=self._port.engine)
        if self._store.key_in_lock:
            self._terminal.say("pulling out the key that may be in the lock")
            self._enter(Cause.EXTRACT, "the key may be in the lock")
            self._retract(self._work(self._bounds.canary_tuple(), SLOW), Report())
        else:
            self._enter(Cause.CONFIRM, f"armed with bounds {self._bounds.hash}")
        if self.state is State.READY:
            self._rehearse()

    def _recover(self) -> None:
        self.alive(PATIENCE_S)
        try:
            self._port.recover(consent("recover"))
        except RobotError as fault:
            self._terminal.say(f"not recovered: {fault}")
            self._prompt()
            return
        self._watch = self._watching()
        self._rehearsed = False
        self._enter(Cause.RECOVER, "recovered; nothing moves before you confirm")
        self._prompt()

    def _replaced(self, thing: str) -> None:
        name = self._bounds.wear.key if thing == "key" else self._bounds.wear.lock
        self._store.set_wear(self._store.wear().replaced(name).tested())
        self._rehearsed = False
        self._enter(Cause.REPLACED, f"{name} is new")
        self._prompt()

    # -- trials ----------------------------------------------------------------------------------

    def _answer(self, asked: pipe.Try) -> None:
        """Run an attempt once, keep the result, then say it."""
        token = asked.trial.token
        if token not in self._answers:
            began_s = time.monotonic()
            ran = self._served(asked)
            result, trace = result_of(
                asked.trial, replace(ran, wall_s=time.monotonic() - began_s), self._cell()
            )
            try:
                self._spool.put(asked.run, result)
                if ran.kind is OutcomeKind.ABORTED and len(ran.log):
                    self._store.keep_log(f"trial-{asked.trial.trial}-{time.time_ns()}", ran.log)
            except OSError as full:  # it is still said
                self._break(full)
            self._answers[token] = pipe.Answer(result=result, trace=trace)
            while len(self._answers) > ANSWERS_MAX:
                self._answers.popitem(last=False)
        self.alive()
        self._say(self._answers[token])

    def _cell(self) -> Cell:
        return Cell(self._task, self._bounds, self._port.joints, self.engine, self._o_t_lock)

    def _served(self, asked: pipe.Try) -> Ran:
        """Run an attempt for the learner; whatever goes wrong, it has an answer."""
        self.peer.running = asked.trial.token
        try:
            return self._attempt(asked)
        except FAULTS as fault:
            self._break(fault)
            return Ran(OutcomeKind.ABORTED, str(fault))
        finally:
            self.peer.running = ""

    def _attempt(self, asked: pipe.Try) -> Ran:
        theta = np.array(asked.trial.theta)
        if why := self._bounds.objection(theta):
            return Ran(OutcomeKind.REJECTED, why)
        owed = self._owed()
        if self.state is not State.READY or not self._rehearsed or owed:
            why = f"the arm is {self.state} and waits for its operator: {owed or self._why}"
            return Ran(OutcomeKind.ABORTED, why)
        if self._step and not self._granted(f"trial {asked.trial.trial}"):
            return Ran(OutcomeKind.ABORTED, "the operator did not grant this trial")
        return self._perform(self._work(theta, 1.0))

    def _granted(self, what: str) -> bool:
        """Ask for one trial in ``--step``; anything but 'go' is a no.

        Raises:
            MotionEnded: If the robot stopped, or somebody leads it, meanwhile.
        """
        self._ask(f"{what}: type 'go' to run it, anything else to skip")
        while not (self.peer.halt_why or self.peer.leaving):
            self.alive()
            self._must_be_left()
            try:
                item = self.inbox.get(timeout=IDLE_S)
            except Empty:
                continue
            if isinstance(item, Line) and item.text == "go":
                if item.at_s >= self._asked_s:
                    return True
                self._terminal.say("'go' was typed before this was asked, and does not count")
                continue
            self.inbox.put(item)  # for the loop, once this is answered
            return False
        return False

    def _work(self, theta: Array, pace: float) -> Work:
        p, limits = self._task.work(theta, self._bounds, self._port.joints)
        return Work(p, limits, self._o_t_lock, self._bounds, pace)

    def _rehearse(self) -> None:
        """Run the canary slowly before anything counts."""
        self._terminal.say(f"rehearsal at {SLOW:.0%} of the speed: watch it, 'stop' stops it")
        ran = self._perform(self._work(self._bounds.canary_tuple(), SLOW))
        if self.state is not State.READY:
            return
        verdict = ran.why or self._task.verdict(ran.report)
        self._store.note("rehearsed", verdict=verdict)
        self._terminal.say(f"rehearsal: {verdict}")
        if ran.kind is not OutcomeKind.SUCCESS:
            self._prompt()
            return
        self._rehearsed = True
        self._store.set_wear(self._store.wear().tested())  # it was the canary's tuple
        self._tell("ready for trials")

    def _care(self) -> None:
        """See to wear and canary between trials; may leave READY.

        Since that is owed no trial is taken, and the worker heard so before the last answer: no
        attempt's deadline runs meanwhile. One that comes all the same waits its turn.
        """
        resting = self.state is State.READY and self._rehearsed and not self.peer.leaving
        if not resting or not self._owed():
            return
        if why := worn(self._store.wear(), self._bounds.wear):
            self._enter(Cause.WEAR, why)
        elif not self._step or self._granted("the canary"):
            self._try_canary()

    def _try_canary(self) -> None:
        """Try what is known to work; key and lock are worn when it fails again and again."""
        for again in range(CANARIES):
            self._terminal.say("the canary once more" if again else "the canary's turn")
            ran = self._perform(self._work(self._bounds.canary_tuple(), 1.0))
            if self.state is not State.READY or self.peer.leaving:
                return
            cost = self._task.cost(ran.report, self._bounds) if ran.is_judged else None
            verdict = ran.why or self._task.verdict(ran.report)
            self._store.note("canary", verdict=verdict, cost=cost)
            if ran.kind is OutcomeKind.SUCCESS:
                self._store.set_wear(self._store.wear().tested())
                self._tell("the canary works: trials are taken again")
                return
        if ran.is_judged:
            self._enter(Cause.WEAR, f"the canary failed {CANARIES} times: look at key and lock")
        else:
            self._break(MotionEnded(Ending.INVALID, f"the canary has no verdict: {ran.why}"))
