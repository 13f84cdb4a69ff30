"""What both kinds of Franka share: latching, taring, the soft guard, free motion, recovery.

Everything runs under one impedance controller in the client library's own 1 kHz thread. The two
adapters (:mod:`~shearline.evaluator.robot.franky`, :mod:`~shearline.evaluator.robot.panda`) say how
their library begins, aims and ends it; this module makes a :class:`RobotPort` of that.

Two traps are closed here. The robot reports the wrench that the *arm* exerts, so its sign is
turned. And between motions a read may block for ever if the robot's clock stands, so it happens
in a thread of its own and :meth:`Franka.sample` waits for it only a moment.
"""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable

import numpy as np

from shearline.evaluator.robot.client import (
    COLUMNS,
    FELT,
    JOINTS,
    Client,
    Drive,
    sample_of,
    tared,
)
from shearline.evaluator.robot.errors import (
    Ending,
    MotionEnded,
    RobotError,
    RobotRefused,
    RobotUnreachable,
)
from shearline.evaluator.robot.free import ARRIVED_RADPS, arrived, free_motion, lead
from shearline.evaluator.robot.path import Line, off, shifted
from shearline.evaluator.robot.port import (
    TARE_SHARE,
    Array,
    Consent,
    Contact,
    Guard,
    Mode,
    Sample,
    Tool,
)
from shearline.evaluator.robot.reader import Reader
from shearline.evaluator.robot.session import Session
from shearline.evaluator.robot.watch import STALL_S

#: Between two references of a free motion [s]; one never advances by more than twice that.
REFERENCE_S = 5e-3

#: The reference of an arm that stands off the goal is shifted by this share of the error a step.
TRIM = 0.02

#: The robot's own threshold for forces: above the guard, which acts first.
REFLEX_SHARE = 1.3

#: A brake that was not heard is repeated after this [s].
BRAKE_AGAIN_S = 5e-3

#: The tare is the mean of so many states, over so long [s].
TARE_SAMPLES, TARE_S = 20, 0.1

START_S, READ_S, RECOVERY_S = 1.0, 0.02, 30.0


class Franka:
    """A Franka arm behind one of the two client libraries; a :class:`RobotPort`.

    Args:
        client: The library.
        address: Where the robot listens.
    """

    joints = JOINTS

    def __init__(self, client: Client, address: str) -> None:
        self._client = client
        self._address = address
        self._reader = Reader(client.read)
        self._last: Sample | None = None
        self._tool: Tool | None = None
        self._guard: Guard | None = None
        self._tare = np.zeros(FELT.size)
        self._latch: MotionEnded | None = None
        self._session: Session | None = None
        self._engine = ""
        self._open = False

    @property
    def engine(self) -> str:
        """Fingerprint of robot and library."""
        return self._engine

    # -- connection -------------------------------------------------------------------------------

    def open(self, tool: Tool) -> None:
        """Connect; see :meth:`RobotPort.open`."""
        self._connect(tool)
        try:
            mode = self.sample().mode
        except MotionEnded as ended:
            self.close()
            raise RobotUnreachable(str(ended)) from ended
        if mode is not Mode.IDLE:
            self.close()
            raise RobotRefused(
                f"the robot at {self._address} is {mode}, expected idle: release stop button and"
                " brakes, recover it in Desk, and begin again"
            )

    def _connect(self, tool: Tool) -> None:
        self._engine = self._client.connect(self._address)
        self._open, self._tool, self._last = True, tool, None
        try:
            self._client.set_tool(tool)
        except RobotError:
            self.close()
            raise

    def close(self) -> None:
        """Let go of the connection."""
        if self._open:
            self._open = False
            if self._client.running():
                self._client.brake()
            self._client.disconnect()

    # -- states -----------------------------------------------------------------------------------

    def sample(self) -> Sample:
        """Return the newest state, without waiting for one for longer than a moment."""
        self._expect_open()
        row = self._client.newest() if self._client.running() else None
        if row is not None:
            moving = sample_of(tared(row, self._tare), Mode.MOVE)
            if self._last is not None and moving.t_s < self._last.t_s:
                return self._last._replace(mode=Mode.MOVE)  # the motion's states lag at its start
            self._last = moving
            return moving
        try:
            fresh = self._read(READ_S)
            if fresh is not None and self._last is not None and fresh.t_s < self._last.t_s:
                fresh = self._read(READ_S)  # that one had begun before the last motion did
            self._last = fresh or self._last or self._read(START_S)
        except RobotError as error:
            raise self._lost(str(error)) from error
        if self._last is None:
            raise self._lost(f"the robot at {self._address} sends no states")
        return self._last

    def _lost(self, what: str) -> MotionEnded:
        self._latched(Ending.LINK, what)
        return MotionEnded(Ending.LINK, what)

    def _read(self, patience_s: float) -> Sample | None:
        """Read a state, or return ``None`` if none comes in time; raises if the link is lost."""
        read = self._reader.get(patience_s)
        if read is None:
            return None
        row, mode, errors = read
        return sample_of(tared(row, self._tare), mode, errors)

    def drain_log(self) -> Array:
        """Return the log."""
        rows = self._client.rows()
        return np.array([tared(row, self._tare) for row in rows]).reshape(-1, COLUMNS)

    # -- guard ------------------------------------------------------------------------------------

    def set_guard(self, guard: Guard, *, tare: bool = True) -> None:
        """Keep to a guard, and tare unless told not to."""
        self._expect_open()
        if self._client.running() or np.abs(self.sample().dq).max() > ARRIVED_RADPS:
            raise RobotRefused("the arm moves, expected it at rest: set its limits before it moves")
        zero = self._zero(guard) if tare else self._tare
        self._limit(guard, zero)
        self._guard, self._tare = guard, zero

    def _zero(self, guard: Guard) -> Array:
        """Return what the robot feels at rest, untared, if that can be nothing."""
        felt = np.mean([self._felt() for _ in range(TARE_SAMPLES)], axis=0) + self._tare
        tau, force, torque = felt[:JOINTS], *map(np.linalg.norm, (felt[JOINTS:10], felt[10:]))
        most = TARE_SHARE * np.array([*guard.tau_ext_max, guard.force_max_n, guard.torque_max_nm])
        if not (np.array([*np.abs(tau), force, torque]) <= most).all():  # also NaN
            raise RobotRefused(
                f"at rest the tip feels {force:.1f} N and {torque:.2f} N m and a joint"
                f" {np.abs(tau).max():.1f} N m, expected at most {TARE_SHARE:.0%} of the guard:"
                " free the tool, or correct its mass"
            )
        zero: Array = felt
        return zero

    def _felt(self) -> Array:
        time.sleep(TARE_S / TARE_SAMPLES)
        sample = self.sample()
        return np.concatenate([sample.tau_ext, sample.o_f_ext])

    def _limit(self, guard: Guard, tare: Array) -> None:
        """Have the robot itself stop at the guard's torques, and beyond the guard's forces."""
        off = np.abs(tare)
        force = np.array([guard.force_max_n] * 3 + [guard.torque_max_nm] * 3)
        self._client.set_limits(
            guard.tau_ext_max + off[:JOINTS], REFLEX_SHARE * force + off[JOINTS:]
        )

    # -- motions ----------------------------------------------------------------------------------

    def contact(self, contact: Contact) -> Session:
        """Begin impedance control where the arm stands."""
        self._expect_ready()
        assert self._guard is not None
        drive = Drive(contact, self._guard, self._tare)
        session = self._session = Session(self, self._client, self._client.clip(contact))
        try:
            self._client.begin(drive)
        except BaseException:
            session.over = True
            raise
        deadline = time.monotonic() + START_S
        while self._client.newest() is None:
            if not self._client.running():
                raise self.ended() or self._latched(Ending.INVALID, "the motion did not begin")
            if time.monotonic() > deadline:
                self._client.finish()
                raise self._latched(Ending.INVALID, f"no state came in {START_S} s of a motion")
            time.sleep(1e-3)
        return session

    def is_current(self, session: Session) -> bool:
        """Tell whether a session is that of the last contact."""
        return session is self._session

    def may_aim(self, pose: Array) -> bool:
        """Tell whether a pose may be aimed at; latch if it is none."""
        if not np.isfinite(pose).all():
            self._latched(Ending.INVALID, "a reference has numbers that are not finite")
        return self._latch is None

    def move_free(self, o_t_ee: Array, speed_mps: float) -> None:
        """Move along a straight line, and correct what friction leaves at its end."""
        self._expect_ready()
        assert self._guard is not None
        low, high = self._guard.box_m
        if (o_t_ee[:3, 3] < low).any() or (o_t_ee[:3, 3] > high).any():
            goal = np.round(o_t_ee[:3, 3], 4).tolist()
            raise MotionEnded(Ending.GUARD, f"the goal {goal} m is outside of the tip's box")
        start = self.sample().o_t_ee
        if not (np.isfinite(start).all() and np.isfinite(o_t_ee).all()):
            raise self._latched(Ending.INVALID, "start or goal has numbers that are not finite")
        line, contact = free_motion(start, o_t_ee, speed_mps, self._guard)
        session = self.contact(contact)
        try:
            self._follow(session, line, o_t_ee)
        except BaseException:
            if self._client.running():
                self._client.finish()
            raise
        session.end()

    def _follow(self, session: Session, line: Line, goal: Array) -> None:
        """Lead the arm along a line, and then by what is missing, until it is there."""
        at_s, shift = 0.0, np.zeros(6)
        before = self.sample()
        while True:
            ahead = lead(line, at_s, self._client.turning)
            session.ref(shifted(line.at(at_s), shift + ahead))
            now = self._after(before.t_s + REFERENCE_S)
            at_s += min(now.t_s - before.t_s, 2.0 * REFERENCE_S)
            before = now
            if at_s >= line.length_s:
                if arrived(now, goal):
                    return
                shift += TRIM * off(now.o_t_ee, goal)

    def _after(self, t_s: float) -> Sample:
        """Wait for a state of the robot's time ``t_s`` or later."""
        deadline = time.monotonic() + START_S
        while True:
            sample = self.sample()
            if sample.t_s >= t_s or not self._client.running():
                return sample
            if time.monotonic() > deadline:
                self._client.finish()
                raise self._latched(
                    Ending.INVALID, f"the robot's clock has stood at {sample.t_s:.3f} s"
                )
            time.sleep(5e-4)

    def ended(self) -> MotionEnded | None:
        """Wait for the end of the motion that runs, and return why, if not by our own wish."""
        how = self._client.outcome()
        if self._latch is not None:
            return self._latch
        if how is not None and how.ending not in {Ending.TIME, Ending.GUARD}:
            self._latch = how
        return how

    # -- stopping and going on --------------------------------------------------------------------

    def stop(self) -> None:
        """Latch, and have the robot brake."""
        self._latched(Ending.STOPPED, "stopped on request")
        session = self._session
        if self._open and session is not None and not session.over:
            brake = functools.partial(self._brake, session)
            threading.Thread(target=_quietly, args=(brake,), daemon=True).start()

    def _brake(self, session: Session) -> None:
        """Brake until the motion is over: one that only just begins may not hear the first."""
        deadline, ran = time.monotonic() + START_S, False
        while self._open and session is self._session and not session.over:
            runs = self._client.running()
            if (ran and not runs) or time.monotonic() > deadline:
                return
            ran = ran or runs
            _quietly(self._client.brake)
            time.sleep(BRAKE_AGAIN_S)

    def recover(self, consent: Consent) -> None:
        """Clear the latch and the robot's errors."""
        assert isinstance(consent, Consent)
        tool = self._tool
        assert tool is not None, "recover() before open()"
        if not self._answers():
            self._reconnect(tool)
        try:
            self._until_idle()
        except MotionEnded as ended:
            raise RobotUnreachable(str(ended)) from ended
        if self._guard is not None:
            self._limit(self._guard, self._tare)
        self._latch = None

    def _answers(self) -> bool:
        """Tell whether the connection still brings states."""
        if not self._open or (self._latch is not None and self._latch.ending is Ending.LINK):
            return False
        try:
            return self._client.running() or self._read(START_S) is not None
        except RobotError:
            return False

    def _until_idle(self) -> None:
        """Have the robot recover, and wait for it: it answers before it is ready."""
        deadline, asked = time.monotonic() + RECOVERY_S, False
        while (sample := self.sample()).mode is not Mode.IDLE:
            if sample.mode in {Mode.REFLEX, Mode.USER_STOPPED} and not asked:
                self._client.recover()
                asked = True
            if time.monotonic() > deadline:
                raise RobotRefused(
                    f"the robot is still {sample.mode} {RECOVERY_S:.0f} s after its recovery:"
                    " look at it in Desk"
                )
            time.sleep(0.01)

    def _reconnect(self, tool: Tool) -> None:
        self.close()
        self._reader = Reader(self._client.read)
        self._latch = None
        self._connect(tool)

    # -- what must be true ------------------------------------------------------------------------

    def _latched(self, ending: Ending, what: str) -> MotionEnded:
        """Latch, unless it is already, and return what is to be raised."""
        if self._latch is None:
            self._latch = MotionEnded(ending, what)
        return self._latch

    def _expect_open(self) -> None:
        if not self._open:
            raise RobotUnreachable(f"the port to {self._address} is closed: open it first")

    def _expect_ready(self) -> None:
        self._expect_open()
        if self._latch is not None:
            raise MotionEnded(self._latch.ending, str(self._latch))
        deadline = time.monotonic() + STALL_S
        while self._reader.busy and time.monotonic() < deadline:
            self.sample()
        if self._reader.busy:
            raise self._latched(Ending.INVALID, "the robot sends no new states: its clock stands")
        if self._guard is None:
            raise RobotRefused("no limits were set, expected set_guard() before the first motion")


def _quietly(act: Callable[[], None]) -> None:
    try:
        act()
    except Exception:  # noqa: BLE001 - the latch is set, and nobody waits for this thread
        return
