"""Where the arm stands, and what leads from one state to the next: a table as data.

Everything that can change the state stands in this file. The table does not know who asks; which
causes only a local operator may bring about is data beside it (:data:`OPERATOR`), and nothing that
comes over a network is turned into one of those. Whether the learner can be reached is no state of
the arm: see :class:`Link`. The picture in the docs is the table.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from types import MappingProxyType


class State(enum.StrEnum):
    """Where the arm stands."""

    OFFLINE = "offline"  # no connection to the robot
    IDLE = "idle"  # connected and checked; nothing may move
    READY = "ready"  # armed, in front of the lock, takes a trial
    APPROACH = "approach"  # moves in free space to where a trial starts
    CONTACT = "contact"  # the key may be in the lock
    RETRACT = "retract"  # pulls the key out
    PAUSED = "paused"  # armed, but takes no trial
    HOLD = "hold"  # somebody stopped it: stop button, emergency stop, the operator's word
    FAULT = "fault"  # the robot, its link or its sensors cannot be trusted
    JAMMED = "jammed"  # the key does not come out; the gripper stays closed
    WORN = "worn"  # key or lock have done their work, or the canary says so


class Cause(enum.StrEnum):
    """What can happen to the arm."""

    OPENED = "opened"
    CONFIRM = "confirm"
    EXTRACT = "extract"
    TRIAL = "trial"
    ARRIVED = "arrived"
    OVER = "over"
    CLEAR = "clear"
    STUCK = "stuck"
    PAUSE = "pause"
    RESUME = "resume"
    STOP = "stop"
    FAIL = "fail"
    WEAR = "wear"
    RECOVER = "recover"
    REPLACED = "replaced"
    CLOSE = "close"


#: Only the operator at the robot's own terminal brings these about.
OPERATOR = frozenset({Cause.CONFIRM, Cause.EXTRACT, Cause.RECOVER, Cause.REPLACED})

#: Left by an act of the operator alone.
STUCK = frozenset({State.HOLD, State.FAULT, State.JAMMED, State.WORN})

#: In these the robot may be moving.
MOVING = frozenset({State.APPROACH, State.CONTACT, State.RETRACT})

_BROKEN = {Cause.STOP: State.HOLD, Cause.FAIL: State.FAULT}

TABLE: Mapping[State, Mapping[Cause, State]] = MappingProxyType(
    {
        State.OFFLINE: {Cause.OPENED: State.IDLE},
        State.IDLE: {
            Cause.CONFIRM: State.READY,
            Cause.EXTRACT: State.RETRACT,
            Cause.WEAR: State.WORN,
            Cause.CLOSE: State.OFFLINE,
            **_BROKEN,
        },
        State.READY: {
            Cause.TRIAL: State.APPROACH,
            Cause.PAUSE: State.PAUSED,
            Cause.WEAR: State.WORN,
            Cause.CLOSE: State.OFFLINE,
            **_BROKEN,
        },
        State.APPROACH: {Cause.ARRIVED: State.CONTACT, Cause.CLEAR: State.READY, **_BROKEN},
        State.CONTACT: {Cause.OVER: State.RETRACT, **_BROKEN},
        State.RETRACT: {Cause.CLEAR: State.READY, Cause.STUCK: State.JAMMED, **_BROKEN},
        State.PAUSED: {Cause.RESUME: State.READY, Cause.CLOSE: State.OFFLINE, **_BROKEN},
        State.HOLD: {Cause.RECOVER: State.IDLE},
        State.FAULT: {Cause.RECOVER: State.IDLE},
        State.JAMMED: {Cause.RECOVER: State.IDLE},
        State.WORN: {Cause.REPLACED: State.IDLE},
    }
)


class Link(enum.StrEnum):
    """Whether the learner can be reached; changes nothing about where the arm stands."""

    UP = "up"
    LOST = "lost"


def advance(state: State, cause: Cause) -> State:
    """Return the state that ``cause`` leads to.

    Raises:
        AssertionError: If the table has no such transition: the caller is wrong, not a peer.
    """
    assert cause in TABLE[state], f"no transition from {state!r} by {cause!r}"
    return TABLE[state][cause]
