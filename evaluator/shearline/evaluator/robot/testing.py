"""The port's contract as a test anyone can hold their own robot class to.

::

    from shearline.evaluator.robot.testing import RobotPortContract

    class TestMyRobot(RobotPortContract):
        def make(self):
            return MyRobot("10.0.0.5")

        def guard(self, port):
            return Guard(...)

It needs pytest. Everything happens in free air about where the arm stands when it is opened, within
:data:`REACH_M` and at most at :data:`SPEED_MPS`: hover the tool there, clear of everything, with
the emergency stop in your hand, and it may run against hardware. It is no safety test.
"""

from __future__ import annotations

import math
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from shearline.evaluator.robot.errors import Ending, MotionEnded, RobotError, RobotRefused
from shearline.evaluator.robot.frames import apart, is_pose
from shearline.evaluator.robot.log import missing
from shearline.evaluator.robot.port import (
    LOG_STEP_S,
    T_MAX_GRACE_S,
    Array,
    Consent,
    Contact,
    ContactSession,
    Guard,
    Mode,
    RobotPort,
    Sample,
    Tool,
    clip_of,
    log_columns,
)
from shearline.evaluator.robot.watch import Watch

#: The tip stays within this of where the arm stood when it was opened [m].
REACH_M = 0.012

#: No faster than this [m/s].
SPEED_MPS = 0.03

#: How near a free motion must come to its goal [m, rad].
ARRIVAL_M = 1e-3
ARRIVAL_RAD = 0.02

#: References are set this far apart [s].
REFERENCE_S = 0.005


class RobotPortContract(ABC):
    """Inherit, say how to make your port and what guard it may have; pytest collects the rest."""

    @abstractmethod
    def make(self) -> RobotPort:
        """Return a fresh port, not opened."""

    @abstractmethod
    def guard(self, port: RobotPort) -> Guard:
        """Return limits for motions within :data:`REACH_M` of where the arm stands."""

    def tool(self) -> Tool:
        """Return what hangs on the flange; by default nothing."""
        return Tool(np.eye(4), 0.0, np.zeros(3))

    def contact(self, sample: Sample, **changes: object) -> Contact:
        """Return a soft contact in the frame of the tip."""
        facts: dict[str, object] = {
            "o_r_c": sample.o_t_ee[:3, :3].copy(),
            "stiffness": np.array([800.0] * 3 + [40.0] * 3),
            "damping": np.array([60.0] * 3 + [13.0] * 3),
            "clip_m": 0.02,
            "clip_rad": 0.05,
            "t_max_s": 2.0,
        }
        return Contact(**(facts | changes))  # type: ignore[arg-type]

    @pytest.fixture
    def port(self) -> Iterator[RobotPort]:
        """Yield an open port with its guard set."""
        port = self.make()
        port.open(self.tool())
        try:
            port.set_guard(self.guard(port))
            port.drain_log()
            yield port
        finally:
            port.close()

    # -- what it is ------------------------------------------------------------------------------

    def test_it_is_a_port(self) -> None:
        """It has the methods, and knows its joints before it is opened."""
        port = self.make()
        assert isinstance(port, RobotPort)
        assert port.joints >= 1

    def test_a_port_that_was_never_opened_can_be_closed_and_stopped(self) -> None:
        """Whoever gives up early calls both, and twice."""
        port = self.make()
        port.stop()
        port.close()
        port.close()

    def test_nothing_moves_before_a_guard_is_set(self) -> None:
        """The first limits come from the lab, not from the port."""
        port = self.make()
        port.open(self.tool())
        try:
            sample = port.sample()
            with pytest.raises(RobotError):
                port.move_free(sample.o_t_ee, SPEED_MPS)
            with pytest.raises(RobotError):
                port.contact(self.contact(sample))
        finally:
            port.close()

    def test_a_tare_that_would_hide_a_touch_is_refused(self, port: RobotPort) -> None:
        """No sensor is so quiet: what it feels now is above a quarter of such a guard."""
        numb = replace(self.guard(port), force_max_n=1e-9)
        with pytest.raises(RobotRefused):
            port.set_guard(numb)
        port.contact(self.contact(port.sample())).end()  # under the guard it had

    def test_limits_can_be_set_without_a_tare(self, port: RobotPort) -> None:
        """As with a key in the lock, whose pull is no zero."""
        port.set_guard(self.guard(port), tare=False)
        port.contact(self.contact(port.sample())).end()

    # -- samples ---------------------------------------------------------------------------------

    def test_a_sample_has_the_shapes_and_values_of_a_real_one(self, port: RobotPort) -> None:
        """One number for each joint, all finite, and a pose that is one."""
        sample, n = port.sample(), port.joints
        for values in (sample.q, sample.dq, sample.tau_j, sample.tau_ext):
            assert values.shape == (n,)
            assert np.isfinite(values).all()
        assert sample.o_f_ext.shape == (6,)
        assert is_pose(sample.o_t_ee)
        assert sample.mode is Mode.IDLE
        assert sample.errors == ()

    def test_the_clock_runs_and_the_sensors_are_alive(self, port: RobotPort) -> None:
        """Half a second of the robot's time: no step back, no stand, not all zeros."""
        watch = Watch(port)
        begin_s = watch.look().t_s
        assert watch.until(begin_s + 0.5).t_s >= begin_s + 0.5

    def test_a_sample_is_not_changed_by_the_next_one(self, port: RobotPort) -> None:
        """Whoever keeps one keeps what was."""
        first = port.sample()
        kept = first.o_t_ee.copy()
        pose = first.o_t_ee.copy()
        pose[2, 3] += REACH_M / 2
        port.move_free(pose, SPEED_MPS)
        port.sample()
        np.testing.assert_array_equal(first.o_t_ee, kept)

    # -- free motion -----------------------------------------------------------------------------

    def test_a_free_motion_arrives_and_stands(self, port: RobotPort) -> None:
        """There and back, no faster than it may."""
        start = port.sample().o_t_ee.copy()
        for offset_m in (REACH_M / 2, 0.0):
            goal = start.copy()
            goal[2, 3] += offset_m
            port.move_free(goal, SPEED_MPS)
            sample = port.sample()
            off_m, off_rad = apart(goal, sample.o_t_ee)
            assert off_m < ARRIVAL_M
            assert off_rad < ARRIVAL_RAD
            assert sample.mode is Mode.IDLE
        log = port.drain_log()
        assert tip_speed(log, port.joints).max() <= 1.1 * SPEED_MPS

    def test_a_goal_outside_the_workspace_is_not_gone_to(self, port: RobotPort) -> None:
        """The tip stays inside."""
        guard = self.guard(port)
        goal = port.sample().o_t_ee.copy()
        goal[2, 3] = guard.box_m[1, 2] + 0.05
        with pytest.raises(MotionEnded) as ended:
            port.move_free(goal, SPEED_MPS)
        assert ended.value.ending is Ending.GUARD
        assert port.sample().o_t_ee[2, 3] <= guard.box_m[1, 2] + ARRIVAL_M

    # -- contact ---------------------------------------------------------------------------------

    def test_a_contact_holds_the_arm_where_it_began(self, port: RobotPort) -> None:
        """Without a reference the tip stays."""
        before = port.sample().o_t_ee.copy()
        session = port.contact(self.contact(port.sample()))
        assert isinstance(session, ContactSession)
        watch = Watch(port)
        after = watch.until(watch.look().t_s + 0.3)
        assert after.mode is Mode.MOVE
        session.end()
        assert apart(before, after.o_t_ee)[0] < 2e-3
        assert port.sample().mode is Mode.IDLE

    def test_a_contact_follows_its_reference(self, port: RobotPort) -> None:
        """Slowly up by a few millimetres, and the tip comes along."""
        start = port.sample().o_t_ee.copy()
        after = self.lift(port, REACH_M / 2)
        assert after.o_t_ee[2, 3] - start[2, 3] == pytest.approx(REACH_M / 2, abs=1.5e-3)

    def test_a_contact_pulls_no_harder_than_its_clip(self, port: RobotPort) -> None:
        """Along no axis of the compliance frame, also where it clips along others."""
        contact = self.contact(port.sample())
        session = port.contact(contact)
        clip = clip_of(session, contact)
        session.end()
        reach = float(np.abs(contact.o_r_c.T @ clip.o_r).sum(axis=1).max())
        assert reach * clip.m <= contact.clip_m * (1.0 + 1e-6)
        assert reach * clip.rad <= contact.clip_rad * (1.0 + 1e-6)

    def test_a_contact_goes_on_with_other_gains(self, port: RobotPort) -> None:
        """Softer and stiffer again, and the tip stays."""
        sample = port.sample()
        contact = self.contact(sample)
        session, watch = port.contact(contact), Watch(port)
        last = watch.look()
        for share in (0.5, 1.0):
            session.gains(share * contact.stiffness, math.sqrt(share) * contact.damping)
            last = watch.until(last.t_s + 0.1)
        assert last.mode is Mode.MOVE
        session.end()
        assert apart(sample.o_t_ee, last.o_t_ee)[0] < 2e-3

    def test_a_contact_ends_by_itself_when_its_time_is_up(self, port: RobotPort) -> None:
        """The watchdog of a skill that hangs: nobody calls ``end``."""
        sample = port.sample()
        session = port.contact(self.contact(sample, t_max_s=0.3))
        watch = Watch(port)
        begin_s = watch.look().t_s
        last = sample
        while (last := watch.until(last.t_s + LOG_STEP_S)).mode is Mode.MOVE:
            assert last.t_s < begin_s + 1.0, "the contact goes on after its time"
        assert last.t_s <= begin_s + 0.3 + T_MAX_GRACE_S + 0.05
        with pytest.raises(MotionEnded) as ended:
            session.ref(sample.o_t_ee)
        assert ended.value.ending is Ending.TIME
        port.contact(self.contact(port.sample(), t_max_s=0.3)).end()  # it latched nothing

    # -- stopping --------------------------------------------------------------------------------

    def test_stop_ends_a_contact_and_latches_until_an_operator_consents(
        self, port: RobotPort
    ) -> None:
        """Called twice, from another thread."""
        session = port.contact(self.contact(port.sample()))
        for _ in range(2):
            stopper = threading.Thread(target=port.stop)
            stopper.start()
            stopper.join()
        with pytest.raises(MotionEnded) as ended:
            follow(session, port)
        assert ended.value.ending is Ending.STOPPED
        for _ in range(2):
            with pytest.raises(MotionEnded) as refused:
                port.move_free(port.sample().o_t_ee, SPEED_MPS)
            assert refused.value.ending is Ending.STOPPED
        port.recover(CONSENT)
        assert port.sample().mode is Mode.IDLE
        port.contact(self.contact(port.sample())).end()

    def test_a_stop_without_a_motion_latches_too(self, port: RobotPort) -> None:
        """It may come a moment before the motion that it was meant for."""
        port.stop()
        with pytest.raises(MotionEnded):
            port.contact(self.contact(port.sample()))
        port.recover(CONSENT)

    # -- the log ---------------------------------------------------------------------------------

    def test_the_log_has_every_cycle_of_a_contact(self, port: RobotPort) -> None:
        """A row for each millisecond, named columns, and nothing twice."""
        port.drain_log()
        begin_s = port.sample().t_s
        after = self.lift(port, REACH_M / 4)
        log = port.drain_log()
        assert log.shape[1] == len(log_columns(port.joints))
        assert (np.diff(log[:, 0]) > 0.0).all()
        moving = log[(log[:, 0] >= begin_s) & (log[:, 0] <= after.t_s)]
        assert missing(log, [(float(moving[-100, 0]), float(moving[-1, 0]))]) == 0
        assert len(port.drain_log()) <= 20

    def lift(self, port: RobotPort, height_m: float) -> Sample:
        """Move up by ``height_m`` in a contact and end it; return the last sample in it."""
        sample = port.sample()
        goal = sample.o_t_ee.copy()
        session, watch = port.contact(self.contact(sample)), Watch(port)
        last = watch.look()
        steps = round(height_m / SPEED_MPS / REFERENCE_S)
        for step in range(1, steps + 81):
            goal[2, 3] = sample.o_t_ee[2, 3] + height_m * min(1.0, step / steps)
            session.ref(goal.copy())
            last = watch.until(last.t_s + REFERENCE_S)
        session.end()
        return last


#: What the prompt at the robot's terminal would have made.
CONSENT = Consent(operator="the contract test", said="recover", at_s=0.0)


def follow(session: ContactSession, port: RobotPort) -> None:
    """Set references until the contact is over, for a second at most.

    Raises:
        MotionEnded: When it is.
    """
    end_s = time.monotonic() + 1.0
    while time.monotonic() < end_s:
        session.ref(port.sample().o_t_ee)
        time.sleep(REFERENCE_S)


def tip_speed(log: Array, joints: int) -> Array:
    """Return the speed of the tip over 10 ms each [m/s]."""
    names = log_columns(joints)
    at = np.stack([log[:, names.index(f"o_t_ee.{row}3")] for row in range(3)], axis=1)
    if len(at) <= 10:
        return np.zeros(1)
    span_s = log[10:, 0] - log[:-10, 0]
    speed: Array = np.linalg.norm(at[10:] - at[:-10], axis=1) / span_s
    return speed
