"""The narrow interface to an arm: what a robot must be able to do to become an evaluator.

Whoever has these nine methods can be attached, ``--robot module:Class``; ``testing.py`` holds a
class to them. All values are SI units, radians, the robot's base frame, float64; poses are 4x4
homogeneous matrices in row-major order; every time is the robot's own clock.

A port is used by one thread, except for :meth:`RobotPort.stop`. It decides nothing: states,
bounds, arming and skill are the evaluator's. Three things it must do *below* Python, where a
hung interpreter cannot prevent them: close the impedance loop, keep to the guard, and end a
contact after its time.

**After a motion ended early** (:class:`~shearline.evaluator.robot.errors.MotionEnded`) the arm
stands, or brakes without any further call, and the port is *latched*: each ``move_free`` and
``contact`` raises the same ending again until :meth:`RobotPort.recover` was called with an
operator's consent. Two endings do not latch, because they are ordinary ends of a contact: ``TIME``
and ``GUARD``.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: Rows of a log are this far apart [s].
LOG_STEP_S = 1e-3

#: A port ends a contact at most this long after ``Contact.t_max_s`` [s], Python running or not.
T_MAX_GRACE_S = 0.01

#: No tare hides more than this share of the guard: what is felt beyond it is a touch, no drift.
TARE_SHARE = 0.25


class Mode(enum.StrEnum):
    """What the robot's own controller says that it is doing."""

    IDLE = "idle"  # stands, takes motions
    MOVE = "move"  # a motion of ours is running
    GUIDING = "guiding"  # led by hand
    REFLEX = "reflex"  # stopped by itself; needs recover()
    USER_STOPPED = "user stopped"  # stop button; needs its release, then recover()
    OTHER = "other"  # brakes locked, starting, recovering, in error


class Sample(NamedTuple):
    """The newest that the robot has said.

    Attributes:
        t_s: The robot's clock [s]; grows by at least 1 ms between two states, never falls.
        q: Joint angles or positions ``(n,)`` [rad or m].
        dq: Their rates ``(n,)``.
        tau_j: Measured joint torques or forces ``(n,)`` [N m or N].
        tau_ext: What the surroundings add to them, filtered ``(n,)``; drifts, so it is tared.
        o_t_ee: Pose of the tool's tip in the base frame ``(4, 4)``.
        o_f_ext: Force [N] and torque [N m] *of the surroundings on the tip*, base frame ``(6,)``.
        mode: See :class:`Mode`.
        errors: Names of the robot's present errors; may be empty although :attr:`mode` is not
            idle.
    """

    t_s: float
    q: Array
    dq: Array
    tau_j: Array
    tau_ext: Array
    o_t_ee: Array
    o_f_ext: Array
    mode: Mode
    errors: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Tool:
    """What hangs on the flange.

    Attributes:
        f_t_ee: Pose of the tool's tip in the flange's frame ``(4, 4)``.
        mass_kg: Of all beyond the flange [kg].
        centre_m: Its centre of mass in the flange's frame ``(3,)`` [m].
    """

    f_t_ee: Array
    mass_kg: float
    centre_m: Array


@dataclass(frozen=True, slots=True)
class Guard:
    """Limits that the port keeps in every motion, below Python.

    Attributes:
        tau_ext_max: Largest ``|tau_ext|`` of each joint ``(n,)``, from the tare on.
        force_max_n: Largest external force on the tip [N].
        torque_max_nm: Largest external torque on the tip [N m].
        speed_max_mps: Largest speed of the tip [m/s].
        box_m: Lowest and highest corner of where the tip may be, base frame ``(2, 3)`` [m].
        push_max_n: Largest force that the arm itself exerts at rest in a free motion [N].
        twist_max_nm: Largest torque that it exerts at rest there, about each axis [N m].
    """

    tau_ext_max: Array
    force_max_n: float
    torque_max_nm: float
    speed_max_mps: float
    box_m: Array
    push_max_n: float = 40.0
    twist_max_nm: float = 12.0


@dataclass(frozen=True, slots=True)
class Contact:
    """One stretch of Cartesian impedance control: F = K clip(x_ref - x) - D v.

    The force that the arm exerts at rest is thus at most ``stiffness * clip`` along each axis.

    Attributes:
        o_r_c: Orientation of the compliance frame in the base frame ``(3, 3)``: its axes are
            those of ``stiffness``.
        stiffness: Translations [N/m], then rotations [N m/rad] ``(6,)``.
        damping: Translations [N s/m], then rotations [N m s/rad] ``(6,)``. Along the third axis,
            the one that is pushed along, an arm may brake more but never less.
        clip_m: Largest position error that pulls, each axis of the compliance frame [m].
        clip_rad: Largest rotation error that pulls, each axis [rad].
        t_max_s: The port ends this contact by itself after so much of the robot's time [s].
    """

    o_r_c: Array
    stiffness: Array
    damping: Array
    clip_m: float
    clip_rad: float
    t_max_s: float


@dataclass(frozen=True, slots=True)
class Clip:
    """Along which axes a position error is clipped, and where.

    Attributes:
        o_r: These axes in the base frame, as columns ``(3, 3)``.
        m: Largest position error along each of them that pulls [m].
        rad: Largest rotation error about each of them that pulls [rad].
    """

    o_r: Array
    m: float
    rad: float


@dataclass(frozen=True, slots=True)
class Consent:
    """A local operator's word; only the prompt at the robot's own terminal makes one.

    Attributes:
        operator: Who was at the terminal.
        said: What was typed.
        at_s: When [s since the epoch].
    """

    operator: str
    said: str
    at_s: float


@runtime_checkable
class ContactSession(Protocol):
    """A running contact; ends by :meth:`end`, by its time, by the guard or by a fault.

    A session whose controller clips along other axes than those of the compliance frame, and thus
    earlier, says so with an attribute ``clip``; see :func:`clip_of`.
    """

    def ref(self, o_t_ee: Array) -> None:
        """Set the reference pose of the tip ``(4, 4)``; returns at once.

        Called at 100 to 200 Hz with steps that are already limited; the port holds the last one.
        Until the first call the reference is where the tip was when the contact began.

        Raises:
            MotionEnded: If the contact is over; also the first sign of it.
        """
        ...

    def gains(self, stiffness: Array, damping: Array) -> None:
        """Go on with other gains, both ``(6,)`` as in :class:`Contact`; returns at once.

        Raises:
            MotionEnded: As :meth:`ref`.
        """
        ...

    def end(self) -> None:
        """Stop with the arm at rest and holding itself; does nothing if the contact is over.

        Returns when the robot has left the motion, within 2 s.

        Raises:
            MotionEnded: If the contact had ended by itself before, with why.
        """
        ...


@runtime_checkable
class RobotPort(Protocol):
    """An arm with a tool; constructed without arguments or with one address, touching nothing."""

    @property
    def joints(self) -> int:
        """How many joints, n; known before :meth:`open`."""
        ...

    @property
    def engine(self) -> str:
        """Fingerprint, e.g. ``"fr3 system 5.9.0 franky 2.0.0"``; complete after :meth:`open`."""
        ...

    def open(self, tool: Tool) -> None:
        """Connect, check the version, set the tool; never moves, never releases brakes.

        Raises:
            RobotUnreachable: If nobody answers within 10 s.
            RobotRefused: If version, mode or tool do not fit; the port is closed again.
        """
        ...

    def sample(self) -> Sample:
        """Return the newest state without waiting; works in every mode and between motions.

        During a motion states come from its own 1 kHz cycle. Two calls 5 ms apart return different
        ``t_s``; the caller takes a clock that stands for a dead link.

        Raises:
            MotionEnded: With ``LINK`` if the connection is lost.
        """
        ...

    def set_guard(self, guard: Guard, *, tare: bool = True) -> None:
        """Keep to ``guard`` from now on, and tare ``tau_ext`` and ``o_f_ext`` here and now.

        Only while the arm stands, and to tare only while it touches nothing. No motion is possible
        before the first call.

        Args:
            guard: The limits.
            tare: Whether what is felt now is zero from now on; otherwise the last tare stays, and
                before the first one the robot's own zero.

        Raises:
            RobotRefused: If the arm moves, the robot does not take these limits, or a tare would
                be more than :data:`TARE_SHARE` of the guard on any joint, or in force or torque of
                the tip; guard and tare are then as before.
        """
        ...

    def move_free(self, o_t_ee: Array, speed_mps: float) -> None:
        """Move the tip along a straight line to a pose ``(4, 4)`` and stand there; blocks.

        The speed of the tip never exceeds ``speed_mps``, start and end are smooth.

        Raises:
            MotionEnded: If it does not arrive; the arm stands where it is.
        """
        ...

    def contact(self, contact: Contact) -> ContactSession:
        """Begin impedance control where the arm stands, without a jerk.

        Returns when the controller runs (within 1 s).

        Raises:
            MotionEnded: If it does not begin, or the port is latched.
        """
        ...

    def stop(self) -> None:
        """Brake now and latch: from any thread, at any time, as often as one likes; no waiting.

        Ends what runs with ``STOPPED``; without a motion it only latches. Never raises.
        """
        ...

    def recover(self, consent: Consent) -> None:
        """Clear the latch and the robot's errors, reconnecting if need be; moves nothing.

        Returns when :attr:`Sample.mode` reads idle, at most 30 s later. Does not release a stop
        button, and what ran before does not go on.

        Raises:
            RobotRefused: If the robot does not become idle; it says what keeps it.
            RobotUnreachable: If nobody answers.
        """
        ...

    def drain_log(self) -> Array:
        """Return the 1 kHz log since the last call ``(rows, columns)``, see :func:`log_columns`.

        One row for each cycle of every motion, complete up to its end, also an early one; none are
        lost for 120 s of motion. May hold cycles between motions too.
        """
        ...

    def close(self) -> None:
        """Stop and let go of the connection; does nothing when closed. Never raises."""
        ...


def clip_of(session: object, contact: Contact) -> Clip:
    """Return what a session truly clips with: its own ``clip``, or else what it was told."""
    told = Clip(contact.o_r_c, contact.clip_m, contact.clip_rad)
    own: Clip = getattr(session, "clip", told)
    return own


def log_columns(joints: int) -> tuple[str, ...]:
    """Return the names of a log's columns: a :class:`Sample` flattened, without mode and errors.

    The order is ``t_s``, ``q``, ``dq``, ``tau_j``, ``tau_ext`` (``joints`` each), ``o_t_ee`` (16,
    row after row), ``o_f_ext`` (6).
    """
    names = ["t_s"]
    for name in ("q", "dq", "tau_j", "tau_ext"):
        names += [f"{name}.{j + 1}" for j in range(joints)]
    names += [f"o_t_ee.{row}{column}" for row in range(4) for column in range(4)]
    return (*names, *(f"o_f_ext.{axis}" for axis in ("fx", "fy", "fz", "mx", "my", "mz")))


def log_row(sample: Sample) -> Array:
    """Return a sample as one row of a log."""
    parts = (sample.q, sample.dq, sample.tau_j, sample.tau_ext, sample.o_t_ee.ravel())
    return np.concatenate([[sample.t_s], *parts, sample.o_f_ext])
