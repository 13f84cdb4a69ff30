"""The arm's motions: trials and extractions through the port, from state to state.

Whatever ends a motion early is turned into the state it leads to here and nowhere else: a wish to
halt brings the key out, a stop holds the arm, anything that cannot be trusted is a fault.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

import numpy as np

from shearline.evaluator.robot import pipe
from shearline.evaluator.robot.bounds import Bounds
from shearline.evaluator.robot.errors import Ending, MotionEnded, RobotError
from shearline.evaluator.robot.frames import apart
from shearline.evaluator.robot.ladder import RUNGS, extract
from shearline.evaluator.robot.log import missing
from shearline.evaluator.robot.peer import Peer
from shearline.evaluator.robot.port import Array, Mode, RobotPort
from shearline.evaluator.robot.results import Ran, Task
from shearline.evaluator.robot.states import MOVING, STUCK, Cause, Link, State, advance
from shearline.evaluator.robot.store import Store, worn
from shearline.evaluator.robot.terminal import Terminal, prompt
from shearline.evaluator.robot.trial import Insertion, Report, Work, must_be_free, to_start
from shearline.evaluator.robot.watch import Halted, Watch
from shearline.evaluator.skill.semantic import OPEN, SUCCESS
from shearline.protocol.messages import OutcomeKind

#: A motion in free space, a recovery or a change of controller may keep the thread so long [s].
PATIENCE_S = 45.0

#: Rung of the ladder that needs no word.
GENTLEST = RUNGS[0][0]

#: What may come of a call of the port or of the disk; each of them leads to a state.
FAULTS = (RobotError, OSError)

_HELD = frozenset({Ending.USER_STOP, Ending.STOPPED})
_WORKING = MOVING | {State.READY}
_ORDINARY = frozenset({Ending.TIME, Ending.GUARD})


class Mover:
    """One robot in front of one lock: where it stands, and what brings it elsewhere.

    Args:
        port: Open.
        bounds: The lab's.
        store: The robot's folder.
        task: What is being learned and what fails a trial.
        terminal: The operator's.
        say: Tells the worker.
        o_t_lock: Believed pose of the lock ``(4, 4)``.
    """

    def __init__(
        self,
        port: RobotPort,
        bounds: Bounds,
        store: Store,
        task: Task,
        terminal: Terminal,
        say: Callable[[pipe.Say], None],
        o_t_lock: Array,
    ) -> None:
        self.state = State.OFFLINE
        self.peer = Peer(heard_s=time.monotonic())
        self.alive_until_s = time.monotonic() + PATIENCE_S
        self._port = port
        self._bounds = bounds
        self._store = store
        self._task = task
        self._terminal = terminal
        self._say = say
        self._o_t_lock = o_t_lock
        self._watch = self._watching()
        self._stood: Array | None = None
        self._asked_s = 0.0
        self._retracting = False
        self._rehearsed = False
        self._why = ""

    def alive(self, patience_s: float = 1.0) -> None:
        """Say that this thread is well, and will be for so long [s]."""
        self.alive_until_s = time.monotonic() + patience_s

    def _watching(self) -> Watch:
        return Watch(self._port, self._halt, on_block=lambda: self.alive(PATIENCE_S))

    @property
    def engine(self) -> str:
        """Fingerprint of robot, bounds and skill."""
        return f"{self._port.engine} bounds {self._bounds.hash} skill {self._task.skill}"

    # -- motions ---------------------------------------------------------------------------------

    def _perform(self, work: Work) -> Ran:
        """Run one trial, bring the key out, and return how it went."""
        report, why = Report(), ""
        self._port.drain_log()
        self._watch.refresh()
        self._enter(Cause.TRIAL, "to the start pose")
        try:
            self._insert(work, report)
        except Halted as halted:
            why = str(halted)
        except FAULTS as fault:
            why = str(fault)
            if ending_of(fault) not in _ORDINARY or self.state is not State.CONTACT:
                self._break(fault)
        if self.state is State.APPROACH:
            self._enter(Cause.CLEAR, why)
        elif self.state is State.CONTACT:
            self._enter(Cause.OVER, "")
            self._retract(work, report)
        with self._watch.blocked():
            log = self._port.drain_log()
        lacking = missing(log, report.stretches)
        if lacking and not why:
            why = f"the robot's log lacks {lacking} cycles of the contact"
        if why or report.end.verdict == OPEN:
            return Ran(OutcomeKind.ABORTED, why or "no verdict", report, log)
        won = report.end.verdict == SUCCESS
        return Ran(OutcomeKind.SUCCESS if won else OutcomeKind.FAILURE, "", report, log)

    def _insert(self, work: Work, report: Report) -> None:
        self._must_be_left()
        must_be_free(self._watch, self._o_t_lock)
        to_start(self._port, self._watch, work)
        insertion = Insertion(self._port, self._watch, work, report)
        insertion.approach()
        self._watch.until(0.0)  # a wish to halt is heard before anything touches
        self._store.set_wear(self._store.wear().used(self._bounds.wear.key, self._bounds.wear.lock))
        self._store.mark_key("a trial")
        self._watch.refresh()
        self._enter(Cause.ARRIVED, "")
        insertion.insert()

    def _retract(self, work: Work, report: Report) -> None:
        """Bring the key out, up the ladder, and the arm back to the start pose."""
        self._retracting = True
        try:
            rung = extract(self._port, self._watch, work, report)
            if not rung:
                self._enter(Cause.STUCK, "the key does not come out; the gripper stays closed")
                self._prompt()
                return
            with self._watch.blocked():
                self._port.move_free(work.start_pose(), self._bounds.start.speed_mps * work.pace)
            self._store.clear_key()
            self._enter(Cause.CLEAR, "" if rung == GENTLEST else f"the key came out by a {rung}")
        except FAULTS as fault:
            self._break(fault)
        finally:
            self._retracting = False

    def _must_stand(self) -> None:
        sample = self._watch.look()
        if sample.mode is not Mode.IDLE:
            raise MotionEnded(Ending.INVALID, f"the robot is {sample.mode}, not idle")

    def _must_be_left(self) -> None:
        """Make sure that nobody leads the armed arm, or has led it since it was armed or stood.

        Raises:
            MotionEnded: With ``USER_STOP`` if somebody does: what he consented to is over.
        """
        sample, start = self._watch.look(), self._bounds.start
        if sample.mode is not Mode.IDLE:
            raise MotionEnded(Ending.USER_STOP, f"the robot is {sample.mode}: somebody leads it")
        if self._stood is None:
            self._stood = sample.o_t_ee.copy()
        off_m, off_rad = apart(self._stood, sample.o_t_ee)
        if off_m > start.tolerance_m or off_rad > start.tolerance_rad:
            raise MotionEnded(
                Ending.USER_STOP,
                f"the arm was moved by {off_m * 1e3:.1f} mm and {np.degrees(off_rad):.1f} deg while"
                " it was to stand: somebody led it",
            )

    def _halt(self) -> None:
        """Called at every look of a motion: a sign of life, and who wants it to end."""
        self.alive()
        if self._retracting or self.state not in MOVING:
            return
        why = self.peer.halt_why or self.peer.leaving
        if not why and self.peer.running and self._bounds.link_loss == "stop":
            lost = self.peer.link(time.monotonic()) is Link.LOST
            why = "the learner cannot be reached, and link_loss is 'stop'" if lost else ""
        if why:
            raise Halted(why)

    # -- state -----------------------------------------------------------------------------------

    def _break(self, fault: Exception) -> None:
        """The arm was stopped, or cannot be trusted: brake, and wait for the operator."""
        self._port.stop()
        if self.state in STUCK or self.state is State.OFFLINE:
            return
        if self.state in MOVING and self.state is not State.APPROACH:
            with contextlib.suppress(OSError):  # it was marked before it could be in there
                self._store.mark_key(str(fault))
        self._enter(Cause.STOP if ending_of(fault) in _HELD else Cause.FAIL, str(fault))
        self._prompt()

    def _enter(self, cause: Cause, why: str) -> None:
        before, self.state = self.state, advance(self.state, cause)
        if self.state is State.READY and before is not State.PAUSED:
            self._stood = None  # it stands where it is now
        self._why = why or self._why
        self._store.note("state", before=before, after=self.state, cause=cause, why=why)
        if why and self.state not in MOVING:
            self._terminal.say(f"{self.state}: {why}")
        self._tell(why)

    def _tell(self, why: str) -> None:
        takes = self._rehearsed and self.state in _WORKING and not self._owed()
        self._say(pipe.Stands(state=self.state, why=why, engine=self.engine, takes=takes))

    def _owed(self) -> str:
        """Say what key and lock need before another trial, or ``""``."""
        try:
            wear = self._store.wear()
        except RobotError as damaged:
            return str(damaged)
        if why := worn(wear, self._bounds.wear):
            return why
        return "the canary is due" if wear.since_canary >= self._bounds.canary.every else ""

    def _prompt(self) -> None:
        key_in_lock, rehearsed = self._store.key_in_lock, self._rehearsed
        self._ask(prompt(self.state, key_in_lock=key_in_lock, rehearsed=rehearsed))

    def _ask(self, text: str) -> None:
        """Ask the operator; what was typed before is no answer to it."""
        self._terminal.say(text)
        self._asked_s = time.monotonic()


def ending_of(fault: Exception) -> Ending:
    """Return the ending that a fault amounts to."""
    return fault.ending if isinstance(fault, MotionEnded) else Ending.INVALID
