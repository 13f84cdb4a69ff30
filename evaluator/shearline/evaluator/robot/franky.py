"""An FR3 through franky-control 2.0.0: its Cartesian impedance tracker, its reactions in C++.

The tracker runs at 1 kHz in franky's own thread, and so do the reactions that end a contact by its
time and by the force on the tip: both act with Python hung. Torques, speed and box are looked at
in Python, at each fifth state; beyond the guard's torques the robot stops by itself.
"""

from __future__ import annotations

import os
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from shearline.evaluator.robot.client import (
    END_S,
    SPEED_STATES,
    Drive,
    base_gains,
    beyond,
    end_effector,
    ended,
    errors_of,
    let_go,
    load_of,
    mode_of,
    row_of_state,
)
from shearline.evaluator.robot.errors import Ending, MotionEnded, RobotRefused, RobotUnreachable
from shearline.evaluator.robot.franka import Franka
from shearline.evaluator.robot.port import Array, Clip, Contact, Mode, Tool

#: A contact that ends by itself has this long to brake; within the port's grace [s].
BRAKE_S = 0.02

#: A contact that is asked to end has this long to brake, and may end sooner [s].
FINISH_S = 0.2

#: Gains are smoothed with this time constant [s].
GAINS_S = 5e-3

#: Stiffness that keeps the elbow where it was [N m/rad].
POSTURE = 5.0

#: Python looks at each so many-th state.
LOOK = 5


class FrankyPort(Franka):
    """An FR3 (system 5.9 or newer); a :class:`~shearline.evaluator.robot.port.RobotPort`.

    Args:
        address: Of the robot's control.
    """

    def __init__(self, address: str = "172.16.0.2") -> None:
        super().__init__(FrankyClient(), address)


class FrankyClient:
    """franky, as far as :class:`Franka` needs it."""

    turning = 1.0

    def __init__(self) -> None:
        self._franky: ModuleType | None = None
        self._robot: Any = None
        self._rows: list[Array] = []
        self._lock = threading.Lock()
        self._after_s = self._began_s = 0.0
        self._count = 0
        self._drive: Drive | None = None
        self._motion: Any = None
        self._active = False
        self._asked = False
        self._left: MotionEnded | None = None
        self._failed: Exception | None = None

    def connect(self, address: str) -> str:
        """Connect to an FR3."""
        franky = self._franky = _library()
        config = franky.RealtimeConfig
        real_time = Path("/sys/kernel/realtime").exists()
        policy, priority = os.sched_getscheduler(0), os.sched_getparam(0)
        try:
            self._robot = franky.Robot(
                address, realtime_config=config.Enforce if real_time else config.Ignore
            )
        except franky.IncompatibleVersionException as error:
            raise RobotRefused(f"the robot at {address} speaks another version: {error}") from error
        except franky.NetworkException as error:
            raise RobotUnreachable(f"no robot answers at {address}: {error}") from error
        finally:
            # libfranka makes whoever connects a real-time thread of the highest priority, and what
            # that starts inherits it; only its own control thread needs to be one.
            os.sched_setscheduler(0, policy, priority)
        kernel = "" if real_time else ", kernel not real-time"
        return f"fr3 franky 2.0.0{kernel}"

    def disconnect(self) -> None:
        """Let go of the connection, in a thread: the destructor waits for a running motion."""
        robot, self._robot, self._active = self._robot, None, False
        held = [robot]
        del robot
        let_go(held)

    def set_tool(self, tool: Tool) -> None:
        """Set frame and load of the tool."""
        franky, robot = self._franky, self._robot
        assert franky is not None
        state = robot.state
        frame = end_effector(tool, np.array(state.F_T_NE.matrix))
        mass, centre = load_of(tool, float(state.m_ee), np.ravel(state.F_x_Cee))
        try:
            robot.set_ee(frame.T.ravel().tolist())
            robot.set_load(mass, centre.tolist(), [0.0] * 9)
        except franky.CommandException as error:
            raise RobotRefused(f"the robot does not take the tool: {error}") from error

    def set_limits(self, tau: Array, force: Array) -> None:
        """Set the thresholds of the robot's own reflexes."""
        assert self._franky is not None
        try:
            self._robot.set_collision_behavior(tau, tau, force, force)
        except self._franky.CommandException as error:
            raise RobotRefused(f"the robot does not take these limits: {error}") from error

    def read(self) -> tuple[Array, Mode, tuple[str, ...]]:
        """Read a state."""
        try:
            state = self._robot.state
        except Exception as error:  # franky lets libfranka's and Poco's own types through
            raise RobotUnreachable(f"the connection is lost: {error}") from error
        return row_of_state(state, state.O_T_EE.matrix), mode_of(state), errors_of(state)

    # -- the motion -------------------------------------------------------------------------------

    def clip(self, contact: Contact) -> Clip:
        """Return what the tracker will clip with: along the axes of the base."""
        share = clip_in_base(contact.o_r_c)
        return Clip(np.eye(3), share * contact.clip_m, share * contact.clip_rad)

    def begin(self, drive: Drive) -> None:
        """Start the tracker."""
        franky, contact = self._franky, drive.contact
        assert franky is not None
        state = self._robot.state
        clip = self.clip(contact)
        motion = franky.CartesianImpedanceTrackingMotion(
            translational_error_clip=np.full(3, clip.m),
            rotational_error_clip=np.full(3, clip.rad),
            posture_task=franky.PostureTask(np.array(state.q), POSTURE),
            gains_time_constant=GAINS_S,
        )
        motion.set_gains(_gains(franky, contact))
        motion.set_reference(franky.CartesianReference(target=state.O_T_EE))
        motion.register_callback(self._note)
        lasted = franky.Measure.REL_TIME
        late = lasted >= contact.t_max_s - BRAKE_S
        for condition in (late, _forced(franky, drive)):
            motion.add_reaction(franky.TorqueReaction(condition, self._stop_motion(BRAKE_S)))
        self._drive, self._motion = drive, motion
        self._asked, self._left, self._failed = False, None, None
        with self._lock:  # states of the motion before may still be on their way
            self._after_s, self._count = state.time.to_sec(), 0
        try:
            self._robot.move(motion, asynchronous=True)
        except Exception as error:
            raise self._ended(error) from error
        self._active = True

    def _stop_motion(self, most_s: float) -> Any:
        assert self._franky is not None
        stop = self._franky.TorqueStopMotion(ramp_duration=most_s / 4.0, max_duration=most_s)
        stop.register_callback(self._note)
        return stop

    def _note(self, state: Any, *_: Any) -> None:
        """Keep a state; called for each, in a thread of franky's that may lag."""
        row = row_of_state(state, state.O_T_EE.matrix)
        with self._lock:
            self._rows.append(row)
            if row[0] <= self._after_s:
                return
            self._count += 1
            if self._count == 1:
                self._began_s = float(row[0])
            rows = self._rows[-min(self._count, SPEED_STATES + 1) :]
        if self._count % LOOK == 0 and self._left is None and self._drive is not None:
            self._left = beyond(rows, self._drive)
            if self._left is not None:
                self._wind_down()

    def aim(self, pose: Array) -> None:
        """Set the reference."""
        franky = self._franky
        assert franky is not None
        self._motion.set_reference(franky.CartesianReference(target=franky.Affine(pose)))

    def tune(self, stiffness: Array, damping: Array) -> None:
        """Change the gains."""
        franky, drive = self._franky, self._drive
        if franky is None or drive is None:
            return
        contact = replace(drive.contact, stiffness=stiffness, damping=damping)
        self._motion.set_gains(_gains(franky, contact))

    def newest(self) -> Array | None:
        """Return the newest row of the motion."""
        with self._lock:
            fresh = bool(self._rows) and self._rows[-1][0] > self._after_s
            return self._rows[-1] if fresh else None

    def running(self) -> bool:
        """Tell whether the tracker runs.

        franky is asked only if one was begun: a read between motions holds its lock, and lasts for
        ever if the robot's clock stands.
        """
        return self._active and bool(self._robot.is_in_control)

    def finish(self) -> None:
        """Come to rest."""
        self._asked = True
        self._wind_down()

    def _wind_down(self) -> None:
        if not self.running():
            return
        try:
            self._robot.move(self._stop_motion(FINISH_S), asynchronous=True)
        except Exception as error:  # noqa: BLE001 - it ended just now, and franky says it only once
            self._failed = error

    def brake(self) -> None:
        """Have the robot stop."""
        self._robot.stop()

    def outcome(self) -> MotionEnded | None:
        """Wait for the end."""
        try:
            over = self._robot.join_motion(END_S)
            self._active = not over
            failed, self._failed = self._failed, None
            if failed is not None:
                return self._ended(failed)
            if not over:
                return MotionEnded(Ending.INVALID, f"the robot did not stop within {END_S:.0f} s")
        except Exception as error:  # noqa: BLE001 - whatever it is, the motion is over
            self._active = False
            return self._ended(error)
        return self._own_end()

    def _own_end(self) -> MotionEnded | None:
        """Say why a motion ended without an exception."""
        drive, self._drive = self._drive, None
        if drive is None or self._asked:
            return None
        if self._left is not None:
            return self._left
        lasted_s = self._settle()
        if lasted_s >= drive.contact.t_max_s - 2.0 * BRAKE_S:
            return MotionEnded(Ending.TIME, f"the contact ended after its {lasted_s:.3f} s")
        limit = drive.guard.force_max_n
        return MotionEnded(Ending.GUARD, f"the guard ended the contact: more than {limit:.1f} N")

    def _settle(self) -> float:
        """Wait until the states of a motion that is over have all come; return how long it was."""
        count = -1
        while count != len(self._rows):
            count = len(self._rows)
            time.sleep(0.01)
        with self._lock:
            return float(self._rows[-1][0]) - self._began_s if self._rows else 0.0

    def _ended(self, error: Exception) -> MotionEnded:
        franky, said = self._franky, str(error)
        assert franky is not None
        if isinstance(error, franky.NetworkException):
            return MotionEnded(Ending.LINK, f"the connection is lost: {said}")
        return ended(said)

    def recover(self) -> None:
        """Ask the robot to recover."""
        assert self._franky is not None
        try:
            self._robot.recover_from_errors()
        except self._franky.CommandException as error:
            raise RobotRefused(
                f"the robot does not recover: {error}; release its stop button and look at Desk"
            ) from error

    def rows(self) -> list[Array]:
        """Return all rows since the last call, once none is under way any more."""
        if not self.running() and self._rows:
            self._settle()
        with self._lock:
            rows, self._rows = self._rows, []
        return rows


def clip_in_base(o_r_c: Array) -> float:
    """Return the share of a clip that keeps every axis of the compliance frame within it.

    franky clips along the axes of the base. The largest error along an axis of the compliance
    frame is then the largest row sum of its rotation times the clip; 1 where the axes agree.
    """
    return 1.0 / float(np.abs(o_r_c.T).sum(axis=1).max())


def _gains(franky: ModuleType, contact: Contact) -> Any:
    gains = franky.CartesianImpedanceGains()
    gains.stiffness, gains.damping = base_gains(contact)
    return gains


def _forced(franky: ModuleType, drive: Drive) -> Any:
    """Return the condition, in C++, that the tip feels more force than the guard allows."""
    measure = franky.Measure
    bias = -drive.tare[7:10]
    axes = (measure.FORCE_X, measure.FORCE_Y, measure.FORCE_Z)
    squares = [(axis - float(off)) ** 2.0 for axis, off in zip(axes, bias, strict=True)]
    return squares[0] + squares[1] + squares[2] >= drive.guard.force_max_n**2


def _library() -> ModuleType:
    try:
        import franky  # noqa: PLC0415 - see module
    except ImportError as error:
        raise RobotRefused(
            f"an FR3 needs franky-control, which is not installed ({error}):"
            " pip install 'shearline[robot]'"
        ) from error
    library: ModuleType = franky
    return library
