"""The robot's own controller: modes, motions, reflexes and what a state says; no sockets.

It imitates what a Franka shows through its interface, including what surprises: the external
wrench is what the arm exerts on the surroundings, ``errors`` is empty after a user stop, releasing
the button does not make it ready, and a recovery is answered before the mode reads idle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from emulator import wire
from emulator.wire import Mode, Protocol
from emulator.world import World

from shearline.sims.panda import HAND_CENTRE, HAND_MASS, HAND_REACH_M, JOINTS, Array, rotation_z

#: The robot gives up after so many states in a row without an answer.
LOST_MAX = 20

#: Torques may change by this much in a millisecond; some rounding is allowed for [N m].
TORQUE_STEP = 1.0
TORQUE_STEP_SLACK = 0.05

#: The sensors' noise [N m] on joints, [N, N m] on the wrench, and what they say untouched: as in a
#: report of an arm at rest in libfranka's tracker. A sensor of exact zeros would be a dead one.
NOISE_NM, NOISE_N = 0.02, 0.05
BIAS = np.array([1.4, -0.4, 1.7, 0.0, 0.4, -0.1])

#: Between motions nothing moves, and the state is written anew this often [ms].
IDLE_MS = 10

#: How long a recovery takes after it was answered, unless ordered otherwise.
RECOVERY_MS = 20

#: From the flange to the end effector that the lab has set up: the hand.
F_T_NE: Array = np.eye(4)
F_T_NE[:3, :3] = rotation_z(-math.pi / 4.0)
F_T_NE[2, 3] = HAND_REACH_M

Flags = npt.NDArray[np.bool_]


@dataclass
class Motion:
    """A motion that the client commands.

    Attributes:
        move: Identity of the ``Move`` that is to be answered at its end.
        generator: What states are to say.
        began_ms: When it began.
        answered: Whether the client has answered a state yet.
        silent: States in a row without an answer.
    """

    move: int
    generator: int
    began_ms: int
    answered: bool = False
    silent: int = 0


@dataclass
class Lies:
    """What a broken robot reports; see :mod:`emulator.orders`."""

    frozen: bool = False
    nan: bool = False
    zero_wrench: bool = False
    bias: Array = field(default_factory=BIAS.copy)


class Robot:
    """One arm and its controller.

    Args:
        protocol: Which robot it is.
        world: The arm itself.

    Attributes:
        mode: What it does.
        motion: The client's motion, if one runs.
        lies: What it reports wrongly.
        recovery_ms: How long a recovery takes after it was answered.
        ended: How motions ended, oldest first, ``(how, began_ms, ended_ms)``.
        lost: States without an answer, of all motions.
        answered: States with one.
    """

    def __init__(self, protocol: Protocol, world: World) -> None:
        self.protocol = protocol
        self.world = world
        self.mode = Mode.IDLE
        self.motion: Motion | None = None
        self.lies = Lies()
        self.recovery_ms = RECOVERY_MS
        self.ended: list[tuple[str, int, int]] = []
        self.lost = self.answered = 0
        self._pressed = False
        self._recovered_ms = 0
        self._errors: Flags = np.zeros(wire.ERRORS, dtype=bool)
        self._torque_max, self._force_max = np.full(JOINTS, 20.0), np.full(6, 30.0)
        self._tau = np.zeros(JOINTS)
        self._state = np.zeros((), dtype=protocol.state)
        self._chance = np.random.default_rng(0)
        self._initial()

    @property
    def time_ms(self) -> int:
        """The robot's clock."""
        return int(self._state["message_id"])

    @property
    def state(self) -> bytes:
        """What is sent in this millisecond."""
        return self._state.tobytes()

    def _initial(self) -> None:
        state, one = self._state, np.eye(4).ravel()
        state["message_id"] = max(1000, int(state["message_id"]))  # a clock never falls
        state["success_rate"] = 1.0
        state["EE_T_K"] = state["NE_T_EE"] = one
        state["F_T_NE"] = state["F_T_EE"] = F_T_NE.T.ravel()
        state["m_ee"], state["F_x_Cee"] = HAND_MASS, HAND_CENTRE
        self._f_t_ee = F_T_NE
        self._fill()

    def place(self, seed: int | None) -> None:
        """Begin anew: nothing wrong, nothing counted, the arm at the start; see :class:`World`."""
        assert self.motion is None, "the arm cannot be placed while it moves"
        self.mode, self.lies, self._pressed = Mode.IDLE, Lies(), False
        self._errors[:] = False
        self.recovery_ms = RECOVERY_MS
        self.ended.clear()
        self.lost = self.answered = 0
        self.world.place(seed)
        self._initial()

    # -- the client's wishes ----------------------------------------------------------------------

    def set(self, request: str, payload: bytes) -> None:
        """Obey one of the setters; what has no effect on an external controller is ignored."""
        values = np.frombuffer(payload, "<f8") if len(payload) % 8 == 0 else np.zeros(0)
        state = self._state
        if request == "SetCollisionBehavior":
            self._torque_max, self._force_max = values[21:28], values[46:52]
        elif request == "SetEEToK":
            state["EE_T_K"] = values
        elif request == "SetNEToEE":
            state["NE_T_EE"] = values
            self._f_t_ee = F_T_NE @ values.reshape(4, 4).T
            state["F_T_EE"] = self._f_t_ee.T.ravel()
        elif request == "SetLoad":
            state["m_load"], state["F_x_Cload"], state["I_load"] = (
                values[0], values[1:4], values[4:13],
            )  # fmt: skip
        self._fill()

    def begin(self, move: int, controller: int, generator: int) -> bool:
        """Begin a motion with the client's torques, if the robot is ready for one."""
        if self.mode is not Mode.IDLE or controller != wire.CONTROLLER_EXTERNAL:
            return False
        self.mode = Mode.MOVE
        self.motion = Motion(move, generator + 1, self.time_ms)
        self._tau = np.zeros(JOINTS)
        self._state["reflex_reason"] = False
        return True

    def end(self, how: str, mode: Mode) -> Motion | None:
        """End the motion, if one runs; the arm stands and holds itself."""
        motion, self.motion, self.mode = self.motion, None, mode
        self._tau = np.zeros(JOINTS)
        self.world.hold()
        if motion is not None:
            self.ended.append((how, motion.began_ms, self.time_ms))
        self._fill()
        return motion

    def recover(self) -> str:
        """Begin to recover; return the answer's name."""
        if self._pressed or self.mode in {Mode.OTHER, Mode.GUIDING, Mode.MOVE}:
            return "NotPossible"
        self._errors[:] = False
        self.mode = Mode.RECOVERING
        self._recovered_ms = self.time_ms + self.recovery_ms
        return "Success"

    # -- what befalls it --------------------------------------------------------------------------

    def reflex(self, error: int) -> Motion | None:
        """Stop by itself."""
        self._errors[error] = True
        self._state["reflex_reason"] = self._errors
        return self.end("reflex", Mode.REFLEX)

    def press(self) -> Motion | None:
        """Press the stop button."""
        self._pressed = True
        return self.end("user stop", Mode.USER_STOPPED)

    def release(self) -> None:
        """Release the stop button; the robot still wants to be recovered."""
        self._pressed = False

    # -- time -------------------------------------------------------------------------------------

    def tick(self, command: Any) -> int | None:
        """Go on by 1 ms.

        Args:
            command: The client's answer to the last state, or ``None`` if none came.

        Returns:
            The error that makes the robot stop by itself, or ``None``.
        """
        if not self.lies.frozen:
            self._state["message_id"] += 1
        error = None
        if self.motion is not None:
            error = self._obey(self.motion, command)
            self.world.tick(self._tau)
            error = self._overloaded() if error is None else error
        elif self.mode is Mode.RECOVERING and self.time_ms >= self._recovered_ms:
            self.mode = Mode.IDLE
        elif self.time_ms % IDLE_MS != 0:
            return None
        self._fill()
        return error

    def _obey(self, motion: Motion, command: Any) -> int | None:
        if command is None:
            motion.silent += motion.answered
            self.lost += motion.answered
            if motion.silent >= LOST_MAX:
                return wire.COMMUNICATION_CONSTRAINTS_VIOLATION
            return None
        missed, motion.silent, motion.answered = motion.silent, 0, True
        self.answered += 1
        tau = command["tau_J_d"].copy()
        step = float(np.abs(tau - self._tau).max())
        self._tau = tau
        if not step <= TORQUE_STEP * (missed + 1) + TORQUE_STEP_SLACK:
            return wire.CONTROLLER_TORQUE_DISCONTINUITY
        return None

    def _overloaded(self) -> int | None:
        if (np.abs(self.world.wrench) > self._force_max).any():
            return wire.CARTESIAN_REFLEX
        if (np.abs(self.world.tau_ext) > self._torque_max).any():
            return wire.JOINT_REFLEX
        return None

    def _fill(self) -> None:
        """Write down what the state is to say."""
        state, world, motion = self._state, self.world, self.motion
        now = world.now
        pose = world.flange() @ self._f_t_ee
        state["O_T_EE"] = state["O_T_EE_d"] = state["O_T_EE_c"] = pose.T.ravel()
        state["q"] = state["q_d"] = state["theta"] = now.q
        state["dq"] = state["dq_d"] = state["dtheta"] = now.dq
        state["tau_J_d"] = self._tau
        state["tau_J"] = self._tau + world.gravity
        noise = self._chance.standard_normal(JOINTS + 6)
        state["tau_ext_hat_filtered"] = NOISE_NM * noise[:JOINTS] - world.tau_ext
        wrench = NOISE_N * noise[JOINTS:] - world.wrench + self.lies.bias
        wrench[3:] -= _cross(pose[:3, 3] - now.tip, wrench[:3])
        if self.lies.zero_wrench:
            wrench[:] = 0.0
        state["O_F_ext_hat_K"] = wrench
        state["K_F_ext_hat_K"] = (wrench.reshape(2, 3) @ pose[:3, :3]).ravel()
        if self.lies.nan:
            state["q"] = state["O_T_EE"] = state["O_F_ext_hat_K"] = np.nan
        state["generator"] = wire.GENERATOR_IDLE if motion is None else motion.generator
        state["controller"] = wire.CONTROLLER_OTHER if motion is None else wire.CONTROLLER_EXTERNAL
        state["errors"] = self._errors
        state["mode"] = self.mode


def _cross(a: Array, b: Array) -> Array:
    """Return the cross product of two vectors ``(3,)``; numpy's is slow for one."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
