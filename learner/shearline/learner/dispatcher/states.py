"""The states of run, trial and attempt, and what leads from one to the next: tables as data.

Everything that can change a state stands in this file; nothing here knows who asked for the
change, what time it is, or what a message looks like. The pictures in the docs are the tables.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from types import MappingProxyType
from typing import TypeVar


class RunState(enum.StrEnum):
    """Where the whole run stands."""

    RUNNING = "running"  # trials are handed out
    HELD = "held"  # the operator wants no new attempt; what runs may finish
    STOPPING = "stopping"  # no new attempt ever again in this epoch; waiting for what runs
    ENDED = "ended"  # results are still acknowledged, nothing else happens


#: No attempt is handed out ever again in this epoch.
ENDING = frozenset({RunState.STOPPING, RunState.ENDED})


class RunCause(enum.StrEnum):
    """What can happen to the run."""

    HOLD = "hold"
    RESUME = "resume"
    STOP = "stop"
    END = "end"


class TrialState(enum.StrEnum):
    """Where one trial stands."""

    PENDING = "pending"  # waits to be handed out
    LEASED = "leased"  # at least one attempt of it is live
    COUNTED = "counted"  # has its one outcome, while its episode was open
    LOST = "lost"  # its attempts were used up without a verdict
    LEFT = "left"  # its episode closed at a quorum without it
    LATE = "late"  # has its one outcome, after it had been lost or left


class TrialCause(enum.StrEnum):
    """What can happen to a trial."""

    ISSUED = "issued"  # an attempt of it went live
    RELEASED = "released"  # its last live attempt ended without a verdict
    EXHAUSTED = "exhausted"  # it may not be handed out again
    VERDICT = "verdict"  # its first success or failure arrived
    CLOSED = "closed"  # its episode closed


class AttemptState(enum.StrEnum):
    """Where one attempt stands."""

    LEASED = "leased"  # live: handed out, and its lease runs
    LAPSED = "lapsed"  # its lease or deadline ran out or its evaluator died; a result still counts
    RETURNED = "returned"  # its evaluator left on purpose; a result still counts
    DECIDED = "decided"  # its result is the trial's outcome
    SURPLUS = "surplus"  # its result came when the trial already had its outcome
    ABORTED = "aborted"  # its evaluator reached no verdict
    REJECTED = "rejected"  # out of its evaluator's own bounds


class AttemptCause(enum.StrEnum):
    """What can happen to an attempt."""

    RENEWED = "renewed"
    LAPSED = "lapsed"
    RETURNED = "returned"
    DECIDES = "decides"
    SURPLUS = "surplus"
    ABORTED = "aborted"
    REJECTED = "rejected"


State = TypeVar("State", RunState, TrialState, AttemptState)
Cause = TypeVar("Cause", RunCause, TrialCause, AttemptCause)
Table = Mapping[State, Mapping[Cause, State]]

RUN: Table[RunState, RunCause] = MappingProxyType(
    {
        RunState.RUNNING: {
            RunCause.HOLD: RunState.HELD,
            RunCause.RESUME: RunState.RUNNING,
            RunCause.STOP: RunState.STOPPING,
            RunCause.END: RunState.ENDED,
        },
        RunState.HELD: {
            RunCause.HOLD: RunState.HELD,
            RunCause.RESUME: RunState.RUNNING,
            RunCause.STOP: RunState.STOPPING,
            RunCause.END: RunState.ENDED,
        },
        RunState.STOPPING: {
            RunCause.STOP: RunState.STOPPING,
            RunCause.END: RunState.ENDED,
        },
        RunState.ENDED: {},
    }
)

TRIAL: Table[TrialState, TrialCause] = MappingProxyType(
    {
        TrialState.PENDING: {
            TrialCause.ISSUED: TrialState.LEASED,
            TrialCause.EXHAUSTED: TrialState.LOST,
            TrialCause.VERDICT: TrialState.COUNTED,
            TrialCause.CLOSED: TrialState.LEFT,
        },
        TrialState.LEASED: {
            TrialCause.ISSUED: TrialState.LEASED,
            TrialCause.RELEASED: TrialState.PENDING,
            TrialCause.VERDICT: TrialState.COUNTED,
            TrialCause.CLOSED: TrialState.LEFT,
        },
        TrialState.COUNTED: {TrialCause.CLOSED: TrialState.COUNTED},
        TrialState.LOST: {
            TrialCause.VERDICT: TrialState.LATE,
            TrialCause.CLOSED: TrialState.LOST,
        },
        TrialState.LEFT: {TrialCause.VERDICT: TrialState.LATE},
        TrialState.LATE: {TrialCause.CLOSED: TrialState.LATE},
    }
)

_ANSWERED = {
    AttemptCause.DECIDES: AttemptState.DECIDED,
    AttemptCause.SURPLUS: AttemptState.SURPLUS,
    AttemptCause.ABORTED: AttemptState.ABORTED,
    AttemptCause.REJECTED: AttemptState.REJECTED,
}

ATTEMPT: Table[AttemptState, AttemptCause] = MappingProxyType(
    {
        AttemptState.LEASED: {
            AttemptCause.RENEWED: AttemptState.LEASED,
            AttemptCause.LAPSED: AttemptState.LAPSED,
            AttemptCause.RETURNED: AttemptState.RETURNED,
            **_ANSWERED,
        },
        AttemptState.LAPSED: {AttemptCause.RENEWED: AttemptState.LEASED, **_ANSWERED},
        AttemptState.RETURNED: {**_ANSWERED},
        AttemptState.DECIDED: {},
        AttemptState.SURPLUS: {},
        AttemptState.ABORTED: {},
        AttemptState.REJECTED: {},
    }
)

#: An attempt in one of these has had its result; a further one is a duplicate.
ANSWERED = frozenset(_ANSWERED.values())


def advance(table: Table[State, Cause], state: State, cause: Cause) -> State:
    """Return the state that ``cause`` leads to.

    Raises:
        AssertionError: If the table has no such transition: the caller is wrong, not a peer.
    """
    assert cause in table[state], f"no transition from {state!r} by {cause!r}"
    return table[state][cause]
