"""One trial of the skill on an arm: the same layers, on the robot's own clock.

The semantic and manipulation layers run unchanged at the rate of the references; what they command
becomes references of the robot's impedance controller. This module moves the arm through a port
and reports; it decides neither whether it may nor what becomes of the key afterwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from shearline.evaluator.robot.bounds import Bounds
from shearline.evaluator.robot.errors import Ending, MotionEnded
from shearline.evaluator.robot.frames import apart, in_lock
from shearline.evaluator.robot.port import Array, ContactSession, RobotPort, clip_of
from shearline.evaluator.robot.reference import (
    Reference,
    contact_of,
    damping_of,
    stiffness_of,
    target_of,
)
from shearline.evaluator.robot.sight import Sight, View
from shearline.evaluator.robot.watch import Watch
from shearline.evaluator.skill import semantic
from shearline.evaluator.skill.manipulation import APPROACH_S, command, empty_command
from shearline.evaluator.skill.parameters import Parameters
from shearline.evaluator.skill.semantic import Decision, Limits

#: Python may be away from a contact for so long before the trial is no measurement any more [s].
LATE_S_MAX = 0.25

#: A tick may be this early by the robot's clock, which counts milliseconds in fractions [s].
EARLY_S = 5e-4

#: Slower than this share of the guard's speed, it ended a contact for force or torque.
SPEED_SHARE = 0.8


@dataclass(frozen=True, slots=True)
class Work:
    """What one trial is to do.

    Attributes:
        p: The tuple being tried.
        limits: What ends the trial as a failure.
        o_t_lock: Believed pose of the lock ``(4, 4)``.
        bounds: The lab's.
        pace: Share of the lab's speeds, (0, 1].
    """

    p: Parameters
    limits: Limits
    o_t_lock: Array
    bounds: Bounds
    pace: float = 1.0

    @property
    def tick_s(self) -> float:
        """Time between two references [s]."""
        return 1.0 / self.bounds.contact.reference_hz

    def start_pose(self) -> Array:
        """Return where every trial starts: straight in front of the mouth."""
        return in_lock(self.o_t_lock, (0.0, 0.0, -self.bounds.start.gap_m), (0.0, 0.0, 0.0))


@dataclass(slots=True)
class Report:
    """What became of a trial, as far as it got.

    Attributes:
        end: Where the skill stands; its verdict is ``OPEN`` while there is none.
        stretches: First and last time at which each contact certainly ran [s], robot's clock:
            where the log must be complete.
        notes: ``(t_s, phase, reference x, y, push, wiggle x, y, rx, ry)`` of every tick.
        clipped: Share of the ticks that asked for more than clip and speeds let through.
        late: Ticks that were made up for because Python came late.
    """

    end: Decision = field(default_factory=semantic.beginning)
    stretches: list[tuple[float, float]] = field(default_factory=list)
    notes: list[tuple[float, ...]] = field(default_factory=list)
    clipped: float = 0.0
    late: int = 0

    def begun(self, t_s: float) -> None:
        """Note that a contact runs, first seen now."""
        self.stretches.append((t_s, t_s))

    def ran_until(self, t_s: float) -> None:
        """Note that the contact ran at least until now: it took a reference, or was ended."""
        self.stretches[-1] = (self.stretches[-1][0], t_s)


def must_be_free(watch: Watch, o_t_lock: Array) -> None:
    """Make sure that the key is not where it can only be in the lock, or deeper than its mouth.

    Raises:
        MotionEnded: With ``INVALID`` if it is: a trial from there would succeed at no cost.
    """
    view = Sight(o_t_lock).view(watch.look())
    if view.tip[2] > -semantic.CLEAR_M:
        raise MotionEnded(
            Ending.INVALID,
            f"the tip is {view.tip[2] * 1e3:.1f} mm deep, as if in the lock: free the key first",
        )


def to_start(port: RobotPort, watch: Watch, work: Work) -> None:
    """Bring the arm to the start pose and make sure that it is there, free and tared.

    Raises:
        MotionEnded: If it does not get there; with ``INVALID`` if the robot believes that it is
            elsewhere, or something touches the tool.
        RobotRefused: If the port does not take the lab's guard, or does not tare.
    """
    start, bounds = work.start_pose(), work.bounds.start
    with watch.blocked():
        port.move_free(start, bounds.speed_mps * work.pace)
    off_m, off_rad = apart(start, watch.look().o_t_ee)
    if off_m > bounds.tolerance_m or off_rad > bounds.tolerance_rad:
        raise MotionEnded(
            Ending.INVALID,
            f"the arm is {off_m * 1e3:.1f} mm and {np.degrees(off_rad):.1f} deg off the start pose",
        )
    view = Sight(work.o_t_lock).view(watch.look())
    lateral_m = float(np.hypot(view.tip[0], view.tip[1]))
    # By the tare before: a new one makes zero of whatever touches the tool.
    if not semantic.may_start(float(view.tip[2]), lateral_m, view.tau_ext, work.limits):
        raise MotionEnded(Ending.INVALID, "something touches the tool at the start pose: free it")
    with watch.blocked():
        port.set_guard(work.bounds.port_guard())


def warm(work: Work) -> None:
    """Have the skill's compiled layers loaded; that takes seconds, in which no thread may run."""
    c, tip = empty_command(), np.zeros(3)
    for phase in (semantic.APPROACH, semantic.CONTACT, semantic.INSERTION, semantic.EXTRACTION):
        command(c, phase, 0, tip, 0.0, work.p, work.tick_s)
    felt = np.zeros_like(work.limits.torque)
    sight = semantic.Sight(0.0, 0.0, 0.0, 0.0, APPROACH_S)
    end = semantic.decide(semantic.beginning(), sight, felt, work.p, work.limits, work.tick_s)
    semantic.may_start(0.0, 0.0, felt, work.limits)
    semantic.cost(end, work.limits, work.tick_s)


class Insertion:
    """Runs the skill from the start pose to its verdict.

    Args:
        port: Open, at the start pose, guard set.
        watch: Looks at it.
        work: What to do.
        report: Filled as it goes, whatever happens.
    """

    def __init__(self, port: RobotPort, watch: Watch, work: Work, report: Report) -> None:
        self._port = port
        self._watch = watch
        self._work = work
        self._report = report
        self._sight = Sight(work.o_t_lock)
        self._command = empty_command()
        self._reference = Reference(work.bounds, work.pace)
        self._due_s = 0.0

    def approach(self) -> None:
        """Go to where the skill's own approach ends, in free space.

        The trajectory there is the robot's; that of the skill only says where it ends.
        """
        work, c = self._work, self._command
        view = self._sight.view(self._watch.look())
        ticks = round(APPROACH_S / work.tick_s)
        for tick in range(ticks + 1):
            command(c, semantic.APPROACH, tick, view.tip, 0.0, work.p, work.tick_s)
        goal = in_lock(work.o_t_lock, c.x, c.turn.tolist())
        with self._watch.blocked():
            self._port.move_free(goal, work.bounds.start.speed_mps * work.pace)
        settled = round((APPROACH_S + semantic.SETTLE_S) / work.tick_s)
        self._report.end = Decision(semantic.APPROACH, settled, 0, -1, semantic.OPEN, 0.0)

    def insert(self) -> None:
        """Seek contact and insert, to a verdict.

        Raises:
            MotionEnded: If no verdict was reached.
            Halted: If the trial is to end; the contact has been ended.
        """
        c, work, report = self._command, self._work, self._report
        view = self._sight.view(self._watch.look())
        self._due_s = view.t_s
        self._step(view, self._ticks(view))
        stiffness = stiffness_of(c)
        with self._watch.blocked():
            contact = contact_of(c, work.o_t_lock, work.bounds, work.bounds.contact.trial_s)
            session = self._port.contact(contact)
        view = self._sight.view(self._watch.look())
        report.begun(view.t_s)
        self._due_s = view.t_s  # the skill's clock stands while the robot gets ready
        self._reference.begin(view.tip, view.turn)
        self._reference.reckon_with(clip_of(session, contact), work.o_t_lock)
        try:
            while report.end.verdict == semantic.OPEN:
                if not np.array_equal(stiffness_of(c), stiffness):
                    stiffness = stiffness_of(c)
                    session.gains(stiffness, damping_of(c))
                view = self._tick(session, view)
            with self._watch.blocked():
                session.end()
            report.ran_until(view.t_s)
        except MotionEnded as ended:
            self._judge(ended, view)
        finally:
            report.clipped = self._reference.clipped_share
            with self._watch.blocked():
                _let_go(session)

    def _tick(self, session: ContactSession, view: View) -> View:
        work = self._work
        target = target_of(self._command, view.speed_z)
        self._reference.toward(target, view.tip, view.turn, work.tick_s)
        session.ref(self._reference.pose(work.o_t_lock))
        self._report.ran_until(view.t_s)
        after = self._sight.view(self._watch.until(self._due_s - EARLY_S))
        ticks = self._ticks(after)
        if ticks * work.tick_s > LATE_S_MAX:
            away_s = ticks * work.tick_s
            raise MotionEnded(
                Ending.TIME, f"this computer was away for {away_s:.2f} s of a contact"
            )
        self._report.late += ticks - 1
        self._step(after, ticks)
        return after

    def _ticks(self, view: View) -> int:
        """Return how many ticks are due at a view, and count them as done.

        They keep to the robot's clock from the first on, so that lateness never adds up.
        """
        tick_s = self._work.tick_s
        ticks = max(0, math.floor((view.t_s - self._due_s + EARLY_S) / tick_s) + 1)
        self._due_s += ticks * tick_s
        return ticks

    def _step(self, view: View, ticks: int) -> None:
        """Run the upper layers for ``ticks``, all with what is seen now, and note the last."""
        work, report, c = self._work, self._report, self._command
        x, y, depth = view.tip.tolist()
        sight = semantic.Sight(x, y, depth, -float(view.wrench[2]), APPROACH_S)
        for _ in range(ticks):
            now = semantic.decide(report.end, sight, view.tau_ext, work.p, work.limits, work.tick_s)
            report.end = now
            if now.verdict != semantic.OPEN:
                break
            command(c, now.phase, now.phase_ticks, view.tip, view.speed_z, work.p, work.tick_s)
        w = c.wrench
        report.notes.append(
            (view.t_s, report.end.phase, c.x[0], c.x[1], w[2], w[0], w[1], w[3], w[4])
        )

    def _judge(self, ended: MotionEnded, view: View) -> None:
        """The guard is ahead of the semantic layer: what it stopped for force is that verdict.

        A verdict that there is already stands: behind it a key may meet the bottom of the lock.
        """
        if ended.ending is not Ending.GUARD:
            raise ended
        d = self._report.end
        if d.verdict != semantic.OPEN:
            return
        if self._strayed(view):
            raise ended
        self._report.end = Decision(
            semantic.EXTRACTION, 0, d.search_ticks, d.clock_ticks, semantic.TORQUE, view.tip[2]
        )

    def _strayed(self, view: View) -> bool:
        """Whether the guard may have ended a contact for box or speed; a blow is soon over."""
        guard, newest = self._work.bounds.port_guard(), self._port.sample()
        low, high = guard.box_m
        at = newest.o_t_ee[:3, 3]
        after = self._sight.view(newest)
        moved_m = float(np.linalg.norm(after.tip - view.tip))
        speed = max(abs(view.speed_z), moved_m / max(after.t_s - view.t_s, 1e-3))
        return bool(
            (at < low).any() or (at > high).any() or speed > SPEED_SHARE * guard.speed_max_mps
        )


def _let_go(session: ContactSession) -> None:
    """End a contact that may be over already."""
    try:
        session.end()
    except MotionEnded:
        return
