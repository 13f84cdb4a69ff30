"""What is worth surviving the process: the entries of the journal.

The durable half of the dispatcher's state is a fold over these values and nothing else
(:mod:`shearline.learner.dispatcher.book`), which is why the same journal gives the same state.
Times are the learner's clock [s since the epoch] and never decide anything.
"""

from __future__ import annotations

import enum

import msgspec

from shearline.learner.dispatcher.events import Planned
from shearline.protocol.messages import CommandKind, EpisodeClosed, Purpose, Result, Verdict


class LapseReason(enum.StrEnum):
    """Why an attempt is no longer waited for."""

    LEASE = "lease"  # not renewed in time
    DEADLINE = "deadline"  # renewed for longer than a trial may take
    GONE = "gone"  # its evaluator's liveliness disappeared
    REPLACED = "replaced"  # its evaluator's name is now another process


class Entry(msgspec.Struct, frozen=True, kw_only=True, tag_field="entry"):
    """Base of all entries.

    Attributes:
        at_s: When it was decided.
        stimulus: Number, within its epoch, of the event that caused it.
    """

    at_s: float
    stimulus: int = 0


class RunOpened(Entry, frozen=True, kw_only=True, tag="opened"):
    """The first entry: what the run is."""

    run: str
    config: str


class LearnerBooted(Entry, frozen=True, kw_only=True, tag="booted"):
    """A learner process took the run over; written before it hands anything out."""

    epoch: int


class TrialsProposed(Entry, frozen=True, kw_only=True, tag="proposed"):
    """An episode opened with these trials."""

    episode: int
    trials: list[Planned]


class ConfirmationProposed(TrialsProposed, frozen=True, kw_only=True, tag="confirming"):
    """An episode opened whose outcomes the learner is never told.

    An entry of its own, so that a version that does not know it refuses the journal rather than
    teach the learner what it never asked for.
    """

    purpose: Purpose


class AttemptIssued(Entry, frozen=True, kw_only=True, tag="issued"):
    """A trial is about to be handed to an evaluator; ``copy`` if another attempt is live.

    ``kind`` is the evaluator's. Journals of earlier versions lack it and stay as they were.
    """

    trial: int
    attempt: int
    token: str
    evaluator: str
    boot: str
    copy: bool
    kind: str | msgspec.UnsetType = msgspec.UNSET


class AttemptLapsed(Entry, frozen=True, kw_only=True, tag="lapsed"):
    """An attempt is no longer waited for."""

    token: str
    reason: LapseReason


class AttemptReturned(Entry, frozen=True, kw_only=True, tag="returned"):
    """An evaluator left and gave this attempt back."""

    token: str


class AttemptRevived(Entry, frozen=True, kw_only=True, tag="revived"):
    """A lapsed attempt was renewed before its trial had been handed out again."""

    token: str


class ResultTaken(Entry, frozen=True, kw_only=True, tag="result"):
    """The first result of an attempt, and what was done with it.

    Attributes:
        excused: The abort came of our own stop and is not held against the trial.
    """

    evaluator: str
    verdict: Verdict
    result: Result
    excused: bool = False


class TrialLost(Entry, frozen=True, kw_only=True, tag="lost"):
    """A trial used up its attempts without a verdict."""

    trial: int
    why: str


class EpisodeDone(Entry, frozen=True, kw_only=True, tag="closed"):
    """An episode closed; everything journaled before this was told before the next ask."""

    summary: EpisodeClosed


class RunRuled(Entry, frozen=True, kw_only=True, tag="ruled"):
    """The operator held or resumed the run; a restart keeps to it."""

    kind: CommandKind


class RunEnded(Entry, frozen=True, kw_only=True, tag="ended"):
    """The last decision of a run: it is complete, or it failed for good."""

    ok: bool
    why: str


AnyEntry = (
    RunOpened
    | LearnerBooted
    | TrialsProposed
    | ConfirmationProposed
    | AttemptIssued
    | AttemptLapsed
    | AttemptReturned
    | AttemptRevived
    | ResultTaken
    | TrialLost
    | EpisodeDone
    | RunRuled
    | RunEnded
)
