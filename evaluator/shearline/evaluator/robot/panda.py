"""A Panda, the paper's robot, through panda-python 1.1.1: its Cartesian impedance controller.

The controller runs at 1 kHz in the library's own thread, but that is all there is below Python:
no reaction, no time-out, no clip of the error, and its log is the only view of every state. What
franky does in C++ is therefore done three ways here:

- a thread of Python looks at the newest state at 200 Hz, keeps the reference within the clip of
  where the arm is, and ends the contact by time and by guard;
- the robot's own reflexes stop it beyond the guard's torques and forces;
- **a timer of the kernel ends this process** (SIGALRM) if that thread has not run until the
  contact's time is over, or :data:`HANG_S` if that is later. The robot misses its client within
  20 ms and brakes. A hung interpreter cannot prevent that, so run this port in a process of its
  own.
"""

from __future__ import annotations

import contextlib
import ctypes
import math
import os
import signal
import socket
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from shearline.evaluator.robot.client import (
    END_S,
    JOINTS,
    POSE,
    Drive,
    base_gains,
    beyond,
    end_effector,
    ended,
    errors_of,
    load_of,
    mode_of,
    row_of_state,
)
from shearline.evaluator.robot.errors import Ending, MotionEnded, RobotRefused, RobotUnreachable
from shearline.evaluator.robot.franka import Franka
from shearline.evaluator.robot.path import clipped, quaternion
from shearline.evaluator.robot.port import Array, Clip, Contact, Mode, Tool

#: Between two looks at the newest state [s].
LOOK_S = 5e-3

#: A contact that ends by itself settles for so long before it is left [s].
BRAKE_S = 0.02

#: Python may be away for so long in a contact, whatever is left of it, before the kernel ends this
#: process [s].
HANG_S = 0.25

#: The kernel is this much earlier than the contact's end: the robot needs as long to notice [s].
NOTICE_S = 0.02

#: States that the library keeps: 120 s and some.
LOG_STATES = 130_000

#: Where every Franka takes commands.
COMMAND_PORT = 1337

#: Stiffness that keeps the elbow where it was [N m/rad]. The library's projection leaks a share of
#: it into the tip: 5 N m/rad were seen to leave it 5 mrad off, this a tenth of that.
POSTURE = 0.5

_COLUMN_MAJOR = np.arange(16).reshape(4, 4).T.ravel()


class PandaPort(Franka):
    """A Panda (system 4.2.1 or newer); a :class:`~shearline.evaluator.robot.port.RobotPort`.

    Args:
        address: Of the robot's control.
        hang_s: Python may be away for so long in a contact, whatever is left of it.
    """

    def __init__(self, address: str = "172.16.0.2", hang_s: float = HANG_S) -> None:
        super().__init__(PandaClient(hang_s), address)


class PandaClient:
    """panda-python, as far as :class:`Franka` needs it."""

    turning = math.sqrt(2.0)  # it brakes by the root of a stiffness that is given twice

    def __init__(self, hang_s: float) -> None:
        self._hang_s = hang_s
        self._address = ""
        self._library: ModuleType | None = None
        self._panda: Any = None
        self._controller: Any = None
        self._contact: Any = None
        self._rows: list[Array] = []
        self._newest: Array | None = None
        self._target, self._posture = np.eye(4), np.zeros(JOINTS)
        self._over = threading.Event()
        self._over.set()
        self._asked = False
        self._how: MotionEnded | None = None

    def connect(self, address: str) -> str:
        """Connect to a Panda."""
        self._address = address
        library = self._library = _library()
        config = library.libfranka.RealtimeConfig
        real_time = Path("/sys/kernel/realtime").exists()
        try:
            self._panda = library.Panda(
                address, realtime_config=config.kEnforce if real_time else config.kIgnore
            )
        except library.IncompatibleVersionError as error:
            raise RobotRefused(f"the robot at {address} speaks another version: {error}") from error
        except RuntimeError as error:
            raise RobotUnreachable(f"no robot answers at {address}: {error}") from error
        kernel = "" if real_time else ", kernel not real-time"
        return f"panda panda-python {library.__version__}{kernel}"

    def disconnect(self) -> None:
        """Hang up, and keep the library's object for ever.

        Its destructor reads the robot once more, throws if the link is gone, and so ends the
        process; nothing can be done about that but never to let it run.
        """
        panda, self._panda = self._panda, None
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(panda))
        hang_up(self._address)

    def set_tool(self, tool: Tool) -> None:
        """Set frame and load; the nominal end effector is seen by setting no other for a moment."""
        robot = self._panda.get_robot()
        try:
            robot.set_ee(np.eye(4).ravel().tolist())
            state = self._fresh()
            frame = end_effector(tool, _matrix(state.F_T_EE))
            mass, centre = load_of(tool, float(state.m_ee), np.array(state.F_x_Cee))
            robot.set_ee(frame.T.ravel().tolist())
            robot.set_load(mass, centre.tolist(), [0.0] * 9)
        except RuntimeError as error:
            raise RobotRefused(f"the robot does not take the tool: {error}") from error

    def _fresh(self) -> Any:
        self._panda.get_state()  # what lay in the socket
        return self._panda.get_state()

    def set_limits(self, tau: Array, force: Array) -> None:
        """Set the thresholds of the robot's own reflexes."""
        limits = [tau.tolist(), tau.tolist(), force.tolist(), force.tolist()]
        try:
            self._panda.get_robot().set_collision_behavior(*limits)
        except RuntimeError as error:
            raise RobotRefused(f"the robot does not take these limits: {error}") from error

    def read(self) -> tuple[Array, Mode, tuple[str, ...]]:
        """Read a state."""
        try:
            state = self._fresh()
        except RuntimeError as error:
            raise RobotUnreachable(f"the connection is lost: {error}") from error
        return _row(state), mode_of(state), errors_of(state)

    # -- the motion -------------------------------------------------------------------------------

    def clip(self, contact: Contact) -> Clip:
        """Return what the reference is clipped with."""
        return Clip(contact.o_r_c, contact.clip_m, contact.clip_rad)

    def begin(self, drive: Drive) -> None:
        """Start the controller; never of a robot that is not ready, for the library recovers it."""
        state = self._fresh()
        mode = mode_of(state)
        if mode is not Mode.IDLE:
            raise ended(f"the robot is {mode}")
        assert self._library is not None
        self._controller = self._library.controllers.CartesianImpedance(
            impedance=impedance_of(drive.contact),
            damping_ratio=ratio_of(drive.contact),
            nullspace_stiffness=POSTURE,
            filter_coeff=1.0,
        )
        self._contact = drive.contact
        self._posture = np.array(state.q)
        self._target = _matrix(state.O_T_EE)
        self._asked, self._how, self._newest = False, None, None
        self._panda.enable_logging(LOG_STATES)
        self._over.clear()
        signal.setitimer(signal.ITIMER_REAL, max(drive.contact.t_max_s - NOTICE_S, self._hang_s))
        try:
            self._panda.start_controller(self._controller)
        except RuntimeError as error:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            self._over.set()
            raise ended(str(error)) from error
        threading.Thread(
            target=self._tend, args=(self._panda, drive), daemon=True, name="panda-tend"
        ).start()

    def _tend(self, panda: Any, drive: Drive) -> None:
        """Look after a contact until it is over, also one that is let go of."""
        rows: list[Array] = []
        try:
            while not self._asked and self._how is None:
                row = self.newest()
                if row is not None and (not rows or row[0] > rows[-1][0]):
                    rows = [*rows[-2:], row]
                    self._how = self._judge(rows, drive)
                    if self._how is None:
                        self._send(drive.contact, row)
                panda.raise_error()
                time.sleep(LOOK_S)
            self._settle(panda)
        except RuntimeError as error:
            self._how = ended(str(error))
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            self._leave(panda)

    def _judge(self, rows: list[Array], drive: Drive) -> MotionEnded | None:
        """Return why the contact is to end now, if it is, and set the kernel's timer."""
        lasted_s = float(self._controller.get_time())
        left_s = drive.contact.t_max_s - BRAKE_S - lasted_s
        if left_s <= 0.0:
            return MotionEnded(Ending.TIME, f"the contact ended after its {lasted_s:.3f} s")
        signal.setitimer(signal.ITIMER_REAL, max(left_s + BRAKE_S - NOTICE_S, self._hang_s))
        return beyond(rows, drive)

    def _send(self, contact: Contact, row: Array) -> None:
        """Aim at the target, but no farther from where the arm is than the clip."""
        pose = clipped(self._target, row[POSE].reshape(4, 4), contact)
        self._controller.set_control(pose[:3, 3], quaternion(pose[:3, :3]), self._posture)

    def _settle(self, panda: Any) -> None:
        """Aim at where the arm is for a moment, so that it is left at rest."""
        row = self.newest()
        if row is not None and np.isfinite(row[POSE]).all():
            pose = row[POSE].reshape(4, 4)
            self._controller.set_control(pose[:3, 3], quaternion(pose[:3, :3]), self._posture)
            begun = self._controller.get_time()
            deadline = time.monotonic() + END_S
            while self._controller.get_time() < begun + BRAKE_S and time.monotonic() < deadline:
                panda.raise_error()
                time.sleep(1e-3)

    def _leave(self, panda: Any) -> None:
        """Leave the motion and take the library's log."""
        try:
            panda.stop_controller()
            panda.raise_error()
        except RuntimeError as error:
            self._how = self._how or ended(str(error))
        self._rows += _log(panda.get_log())
        panda.disable_logging()
        self._over.set()

    def aim(self, pose: Array) -> None:
        """Set the target; it is sent, within the clip, at once and again at each look."""
        self._target = np.array(pose)
        row = self._newest
        ends = self._asked or self._how is not None
        if row is not None and not ends and np.isfinite(row[POSE]).all():
            self._send(self._contact, row)

    def tune(self, stiffness: Array, damping: Array) -> None:
        """Change the gains; the clip of the contact stays."""
        contact = replace(self._contact, stiffness=stiffness, damping=damping)
        self._controller.set_impedance(impedance_of(contact))
        self._controller.set_damping_ratio(ratio_of(contact))

    def newest(self) -> Array | None:
        """Return the newest row of the motion.

        While the library leaves its controller it neither feeds its copy of the state nor lets it
        be read; the row before stays the newest then.
        """
        panda = self._panda
        if panda is not None and self._controller.get_time() > 0.0:
            with contextlib.suppress(RuntimeError):
                self._newest = _row(panda.get_state())
        return self._newest

    def running(self) -> bool:
        """Tell whether the controller runs."""
        return not self._over.is_set()

    def finish(self) -> None:
        """Come to rest."""
        self._asked = True

    def brake(self) -> None:
        """Have the robot stop."""
        self._panda.get_robot().stop()

    def outcome(self) -> MotionEnded | None:
        """Wait for the end."""
        if not self._over.wait(END_S):
            return MotionEnded(Ending.INVALID, f"the robot did not stop within {END_S:.0f} s")
        how, self._how = self._how, None
        return how

    def recover(self) -> None:
        """Ask the robot to recover."""
        try:
            self._panda.get_robot().automatic_error_recovery()
        except RuntimeError as error:
            raise RobotRefused(
                f"the robot does not recover: {error}; release its stop button and look at Desk"
            ) from error

    def rows(self) -> list[Array]:
        """Return the rows of all motions that are over."""
        rows, self._rows = self._rows, []
        return rows


def ratio_of(contact: Contact) -> float:
    """Return the damping ratio that the library takes for all axes: that of the third.

    Its damping is 2 ratio sqrt(K), without the arm's inertia.
    """
    return float(contact.damping[2] / (2.0 * math.sqrt(contact.stiffness[2])))


def impedance_of(contact: Contact) -> Array:
    """Return the stiffness ``(6, 6)`` that the library takes for a contact's."""
    gains = diagonal(base_gains(contact)[0])
    gains[3:] *= 2.0  # the library takes half of small angles for the error
    return np.diag(gains)


def diagonal(stiffness: Array) -> Array:
    """Return what of a stiffness ``(6, 6)`` the library can take: the diagonal ``(6,)``.

    It takes the square root of each entry for the damping, so that a negative one beside the
    diagonal would become NaN. The diagonal is exact where the compliance frame's axes lie along
    the base's.
    """
    kept: Array = np.diag(stiffness).copy()
    return kept


def hang_up(address: str) -> None:
    """Shut down this process's connections to a robot's command port.

    The library keeps its sockets to itself, so they are found among the open files.
    """
    peer = (socket.gethostbyname(address), COMMAND_PORT)
    for entry in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(OSError):
            if not entry.is_socket():
                continue
            with socket.socket(fileno=os.dup(int(entry.name))) as held:
                if held.family == socket.AF_INET and held.getpeername() == peer:
                    held.shutdown(socket.SHUT_RDWR)


def _matrix(column_major: Any) -> Array:
    matrix: Array = np.array(column_major).reshape(4, 4).T
    return matrix


def _row(state: Any) -> Array:
    return row_of_state(state, _matrix(state.O_T_EE))


def _log(log: dict[str, list[Any]]) -> list[Array]:
    """Return the library's log as rows."""
    if not log["time"]:
        return []
    parts = [
        np.array(log["time"]).reshape(-1, 1) / 1000.0,
        np.array(log["q"]),
        np.array(log["dq"]),
        np.array(log["tau_J"]),
        -np.array(log["tau_ext_hat_filtered"]),
        np.array(log["O_T_EE"])[:, _COLUMN_MAJOR],
        -np.array(log["O_F_ext_hat_K"]),
    ]
    return list(np.concatenate(parts, axis=1))


def _library() -> ModuleType:
    try:
        import panda_py  # noqa: PLC0415 - see module
        import panda_py.controllers  # noqa: PLC0415
        import panda_py.libfranka  # noqa: PLC0415
    except ImportError as error:
        raise RobotRefused(
            f"a Panda needs panda-python, which is not installed ({error}):"
            " pip install 'shearline[robot]'"
        ) from error
    return panda_py
