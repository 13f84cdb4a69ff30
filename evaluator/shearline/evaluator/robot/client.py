"""A client library of a Franka, as far as a port needs it, and what its states mean.

Rows are raw: flattened as in a log, with signs turned but the robot's bias still in them.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from shearline.evaluator.robot.errors import Ending, MotionEnded, RobotRefused
from shearline.evaluator.robot.frames import inverse
from shearline.evaluator.robot.port import (
    Array,
    Clip,
    Contact,
    Guard,
    Mode,
    Sample,
    Tool,
    log_columns,
)

JOINTS = 7
COLUMNS = len(log_columns(JOINTS))
_TAU_EXT = slice(1 + 3 * JOINTS, 1 + 4 * JOINTS)
POSE = slice(1 + 4 * JOINTS, 17 + 4 * JOINTS)
_WRENCH = slice(17 + 4 * JOINTS, 23 + 4 * JOINTS)

#: What is tared: ``tau_ext`` and wrench.
FELT = np.r_[_TAU_EXT, _WRENCH]

#: Share of the guard's torques at which Python ends a contact, before the robot's own reflex does.
SOFT_SHARE = 0.92

#: The speed of the tip is taken over this many states.
SPEED_STATES = 10

#: A motion that is asked to end does so within this [s].
END_S = 2.0


_MODES = {
    "Idle": Mode.IDLE,
    "Move": Mode.MOVE,
    "Guiding": Mode.GUIDING,
    "Reflex": Mode.REFLEX,
    "UserStopped": Mode.USER_STOPPED,
}

#: Words of libfranka's for the end of a motion, the first that fit count.
_SAID = {
    "User Stop": Ending.USER_STOP,
    "User stopped": Ending.USER_STOP,
    "user stopped": Ending.USER_STOP,
    "preempted": Ending.STOPPED,
    "reflex": Ending.REFLEX,
    "Reflex": Ending.REFLEX,
    "UDP": Ending.LINK,
    "TCP": Ending.LINK,
    "connection": Ending.LINK,
}


@dataclass(frozen=True, slots=True)
class Drive:
    """How the library's controller is to be started.

    Attributes:
        contact: Gains, clips and time.
        guard: What it is to keep to.
        tare: What the robot feels when nothing touches it, ``tau_ext`` and wrench ``(13,)``.
    """

    contact: Contact
    guard: Guard
    tare: Array


class Client(Protocol):
    """A client library, as far as it is needed; all rows are raw, see :func:`row_of`.

    Attributes:
        turning: How much more than it was told to it brakes turning.
    """

    turning: float

    def connect(self, address: str) -> str:
        """Connect and return what the robot is; raises :class:`RobotError`."""
        ...

    def disconnect(self) -> None:
        """Let go of the connection; never raises, never waits for a robot."""
        ...

    def set_tool(self, tool: Tool) -> None:
        """Set frame and load of the tool."""
        ...

    def set_limits(self, tau: Array, force: Array) -> None:
        """Set what makes the robot stop by itself: ``(7,)`` [N m] and ``(6,)`` [N, N m]."""
        ...

    def read(self) -> tuple[Array, Mode, tuple[str, ...]]:
        """Read a state between motions; blocks until the robot sends one."""
        ...

    def clip(self, contact: Contact) -> Clip:
        """Return what it will clip with."""
        ...

    def begin(self, drive: Drive) -> None:
        """Begin impedance control at the present pose."""
        ...

    def aim(self, pose: Array) -> None:
        """Set the controller's reference ``(4, 4)``."""
        ...

    def tune(self, stiffness: Array, damping: Array) -> None:
        """Change the gains ``(6,)`` along the axes of the compliance frame."""
        ...

    def newest(self) -> Array | None:
        """Return the newest row of the running motion."""
        ...

    def running(self) -> bool:
        """Tell whether the controller runs."""
        ...

    def finish(self) -> None:
        """Ask the controller to come to rest and end; does not wait."""
        ...

    def brake(self) -> None:
        """Make the robot stop now; may wait for its answer."""
        ...

    def outcome(self) -> MotionEnded | None:
        """Wait for the end of the motion; return how it ended, ``None`` if :meth:`finish` did."""
        ...

    def recover(self) -> None:
        """Ask the robot to recover; raises :class:`RobotRefused` if it does not want to."""
        ...

    def rows(self) -> list[Array]:
        """Return the rows of all motions since the last call."""
        ...


def row_of(t_s: float, q: Any, dq: Any, tau_j: Any, tau_ext: Any, pose: Any, wrench: Any) -> Array:
    """Return a state of the robot as a row of a log, still with the robot's bias.

    ``tau_ext`` and ``wrench`` come as the robot reports them: what the arm does to its
    surroundings. The row says what the surroundings do to the arm. ``pose`` is ``(4, 4)``.
    """
    return np.concatenate(
        ((t_s,), q, dq, tau_j, np.negative(tau_ext), np.ravel(pose), np.negative(wrench))
    )


def row_of_state(state: Any, pose: Any) -> Array:
    """Return a state of libfranka's, as both libraries show it, as a raw row."""
    return row_of(
        state.time.to_sec(),
        state.q,
        state.dq,
        state.tau_J,
        state.tau_ext_hat_filtered,
        pose,
        state.O_F_ext_hat_K,
    )


def mode_of(state: Any) -> Mode:
    """Return the mode of a state; the libraries' names differ by a leading k."""
    return _MODES.get(state.robot_mode.name.removeprefix("k"), Mode.OTHER)


def errors_of(state: Any) -> tuple[str, ...]:
    """Return the names of a state's errors, which both libraries print as a list."""
    said = repr(state.current_errors).strip("[]")
    return tuple(part.strip().strip('"') for part in said.split(",")) if said else ()


def ended(said: str) -> MotionEnded:
    """Return how a motion ended, from what libfranka says of it."""
    for words, ending in _SAID.items():
        if words in said:
            return MotionEnded(ending, f"the robot ended the motion: {said.splitlines()[0]}")
    return MotionEnded(Ending.INVALID, f"the motion failed: {said}")


def let_go(held: list[Any]) -> None:
    """Drop what is held in a thread of its own: a destructor may wait for a running motion."""
    threading.Thread(target=held.clear, daemon=True).start()


def sample_of(row: Array, mode: Mode, errors: tuple[str, ...] = ()) -> Sample:
    """Return a row as a sample."""
    n = JOINTS
    return Sample(
        float(row[0]),
        row[1 : 1 + n],
        row[1 + n : 1 + 2 * n],
        row[1 + 2 * n : 1 + 3 * n],
        row[_TAU_EXT],
        row[POSE].reshape(4, 4),
        row[_WRENCH],
        mode,
        errors,
    )


def tared(row: Array, tare: Array) -> Array:
    """Return a row without the robot's bias; a sensor that says exactly zero stays zero."""
    clean = row.copy()
    if clean[_WRENCH].any():
        clean[FELT] -= tare
    return clean


def beyond(rows: list[Array], drive: Drive) -> MotionEnded | None:
    """Return why the newest of ``rows`` is to end a contact: the soft guard, or what cannot be."""
    if not np.isfinite(rows[-1]).all():  # compares as within every limit
        return MotionEnded(Ending.INVALID, "the robot says numbers that are not finite")
    if reason := _left(rows, drive):
        return MotionEnded(Ending.GUARD, f"the guard ended the contact: {reason}")
    return None


def _left(rows: list[Array], drive: Drive) -> str:
    """Say what of the soft guard the newest of ``rows`` leaves, or ``""``."""
    guard, row = drive.guard, tared(rows[-1], drive.tare)
    sample = sample_of(row, Mode.MOVE)
    tau, tip = np.abs(sample.tau_ext), sample.o_t_ee[:3, 3]
    if (tau > SOFT_SHARE * guard.tau_ext_max).any():
        joint = int(np.argmax(tau / guard.tau_ext_max))
        return f"joint {joint + 1} felt {tau[joint]:.1f} N m from outside"
    if (force := float(np.linalg.norm(sample.o_f_ext[:3]))) > guard.force_max_n:
        return f"the tip felt {force:.1f} N"
    if (torque := float(np.linalg.norm(sample.o_f_ext[3:]))) > guard.torque_max_nm:
        return f"the tip felt {torque:.2f} N m"
    if (tip < guard.box_m[0]).any() or (tip > guard.box_m[1]).any():
        return f"the tip left its box at {np.round(tip, 4).tolist()} m"
    if len(rows) > SPEED_STATES and row[0] > rows[-1 - SPEED_STATES][0]:
        before = rows[-1 - SPEED_STATES]
        moved = tip - before[POSE].reshape(4, 4)[:3, 3]
        speed = float(np.linalg.norm(moved)) / (row[0] - before[0])
        if speed > guard.speed_max_mps:
            return f"the tip went at {speed:.3f} m/s"
    return ""


def base_gains(contact: Contact) -> tuple[Array, Array]:
    """Return stiffness and damping ``(6, 6)`` in the base frame."""
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = contact.o_r_c
    return (
        turn @ np.diag(contact.stiffness) @ turn.T,
        turn @ np.diag(contact.damping) @ turn.T,
    )


def load_of(tool: Tool, mass_ee: float, centre_ee: Array) -> tuple[float, Array]:
    """Return mass and centre in the flange's frame of what the robot does not know of already.

    Raises:
        RobotRefused: If the robot believes that its end effector is heavier than the whole tool.
    """
    mass = tool.mass_kg - mass_ee
    if mass < -1e-3:
        raise RobotRefused(
            f"the robot's end effector weighs {mass_ee:.3f} kg in Desk, expected at most the"
            f" tool's {tool.mass_kg:.3f} kg: correct the one or the other"
        )
    if mass < 1e-3:
        return 0.0, np.zeros(3)
    return mass, (tool.mass_kg * tool.centre_m - mass_ee * centre_ee) / mass


def end_effector(tool: Tool, f_t_ne: Array) -> Array:
    """Return the tip in the nominal end effector's frame ``(4, 4)``."""
    placed: Array = inverse(f_t_ne) @ tool.f_t_ee
    return placed
