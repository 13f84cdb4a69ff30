"""What goes over the wire: structs and numbers of protocol 5 (Panda) and protocol 10 (FR3).

Everything is little-endian and packed. Sources: ``rbk_types.h`` and ``service_types.h`` of
libfranka-common (Apache-2.0) for version 10; version 5 has the same state in doubles and without
the accelerometers, two more commands, and fewer status codes (libfranka-rs agrees). That the real
clients accept them is what the tests of this folder show.
"""

from __future__ import annotations

import enum
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np

#: Where a robot listens; the clients know no other.
PORT = 1337

#: Command, identity, size of the whole message.
HEADER = struct.Struct("<III")

ERRORS = 41
#: Places of some errors in the arrays of a state.
JOINT_REFLEX, CARTESIAN_REFLEX = 6, 7
COMMUNICATION_CONSTRAINTS_VIOLATION = 25
CONTROLLER_TORQUE_DISCONTINUITY = 32

#: Floating point fields of a state, in order.
_FIELDS = {
    "O_T_EE": 16, "O_T_EE_d": 16, "F_T_EE": 16, "EE_T_K": 16, "F_T_NE": 16, "NE_T_EE": 16,
    "m_ee": 1, "I_ee": 9, "F_x_Cee": 3, "m_load": 1, "I_load": 9, "F_x_Cload": 3,
    "elbow": 2, "elbow_d": 2, "tau_J": 7, "tau_J_d": 7, "dtau_J": 7, "q": 7, "q_d": 7, "dq": 7,
    "dq_d": 7, "ddq_d": 7, "joint_contact": 7, "cartesian_contact": 6, "joint_collision": 7,
    "cartesian_collision": 6, "tau_ext_hat_filtered": 7, "O_F_ext_hat_K": 6, "K_F_ext_hat_K": 6,
    "O_dP_EE_d": 6, "O_ddP_O": 3, "elbow_c": 2, "delbow_c": 2, "ddelbow_c": 2, "O_T_EE_c": 16,
    "O_dP_EE_c": 6, "O_ddP_EE_c": 6, "theta": 7, "dtheta": 7,
}  # fmt: skip


class Mode(enum.IntEnum):
    """What the robot says that it is doing."""

    OTHER = 0
    IDLE = 1
    MOVE = 2
    GUIDING = 3
    REFLEX = 4
    USER_STOPPED = 5
    RECOVERING = 6


#: Nothing generates motions, and the robot's own controller holds the arm.
GENERATOR_IDLE, CONTROLLER_OTHER = 0, 3
#: Torques come from the client.
CONTROLLER_EXTERNAL = 2


def _state(real: str, *, accelerometers: bool) -> np.dtype[Any]:
    fields: list[Any] = [("message_id", "<u8")]
    fields += [(name, real, (n,)) if n > 1 else (name, real) for name, n in _FIELDS.items()]
    if accelerometers:
        fields.append(("accelerometers", real, (36,)))
    fields += [("generator", "u1"), ("controller", "u1")]
    fields += [("errors", "?", (ERRORS,)), ("reflex_reason", "?", (ERRORS,))]
    return np.dtype([*fields, ("mode", "u1"), ("success_rate", real)])


def _command(*, torque_finishes: bool) -> np.dtype[Any]:
    fields: list[Any] = [("message_id", "<u8"), ("q_c", "<f8", (7,)), ("dq_c", "<f8", (7,))]
    fields += [("O_T_EE_c", "<f8", (16,)), ("O_dP_EE_c", "<f8", (6,)), ("elbow_c", "<f8", (2,))]
    fields += [("valid_elbow", "?"), ("motion_finished", "?"), ("tau_J_d", "<f8", (7,))]
    return np.dtype([*fields, ("torque_finished", "?")] if torque_finishes else fields)


@dataclass(frozen=True)
class Protocol:
    """One version of the interface.

    Attributes:
        version: What client and server must agree on exactly.
        state: Sent by the robot each millisecond.
        command: The answer to a state.
        requests: Names of the commands, by number.
        move: Names of the answers to ``Move``, by number.
        stop: Names of the answers to ``StopMove``.
        recovery: Names of the answers to ``AutomaticErrorRecovery``.
    """

    version: int
    state: np.dtype[Any]
    command: np.dtype[Any]
    requests: tuple[str, ...]
    move: tuple[str, ...]
    stop: tuple[str, ...]
    recovery: tuple[str, ...]


_SETTERS = (
    "SetCollisionBehavior", "SetJointImpedance", "SetCartesianImpedance", "SetGuidingMode",
    "SetEEToK", "SetNEToEE", "SetLoad",
)  # fmt: skip
_ENDS = (
    "NotPossible", "StartAtSingularPose", "InvalidArgument", "ReflexAborted", "EmergencyAborted",
    "InputErrorAborted", "Aborted",
)  # fmt: skip

PANDA = Protocol(
    version=5,
    state=_state("<f8", accelerometers=False),
    command=_command(torque_finishes=False),
    requests=(
        "Connect", "Move", "StopMove", "GetCartesianLimit", *_SETTERS, "SetFilters",
        "AutomaticErrorRecovery", "LoadModelLibrary",
    ),
    move=("Success", "MotionStarted", "Preempted", *_ENDS),
    stop=("Success", "NotPossible", "EmergencyAborted", "ReflexAborted", "Aborted"),
    recovery=("Success", "NotPossible", "ManualRequired", "ReflexAborted", "EmergencyAborted"),
)  # fmt: skip

FR3 = Protocol(
    version=10,
    state=_state("<f4", accelerometers=True),
    command=_command(torque_finishes=True),
    requests=(
        "Connect", "Move", "StopMove", *_SETTERS, "AutomaticErrorRecovery", "GetRobotModel",
    ),
    move=("Success", "MotionStarted", "Preempted", "PreemptedBySafety", "RejectedBySafety", *_ENDS),
    stop=("Success", "NotPossible", "Safety", "EmergencyAborted", "ReflexAborted", "Aborted"),
    recovery=(
        "Success", "NotPossible", "Safety", "ManualRequired", "ReflexAborted", "EmergencyAborted",
    ),
)  # fmt: skip

PROTOCOLS = {protocol.version: protocol for protocol in (PANDA, FR3)}
