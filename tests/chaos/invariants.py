"""What the journal of any run must satisfy, whatever happened to its processes.

Written from the protocol's promises alone: it does not use the book or the state tables of the
product, so that a mistake there cannot hide itself here. It knows nothing of processes or time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from shearline.learner.dispatcher.entries import (
    AttemptIssued,
    AttemptLapsed,
    AttemptReturned,
    AttemptRevived,
    ConfirmationProposed,
    Entry,
    EpisodeDone,
    LearnerBooted,
    ResultTaken,
    RunEnded,
    RunOpened,
    RunRuled,
    TrialLost,
    TrialsProposed,
)
from shearline.protocol.messages import (
    DECIDING,
    JUDGED,
    Ack,
    CommandKind,
    OutcomeKind,
    Result,
    Trial,
    Verdict,
)

#: Live attempts one trial may have at once.
LIVE_MAX = 2


class BrokenError(AssertionError):
    """An invariant does not hold; the text says which, and at which entry."""


@dataclass(slots=True)
class AuditedTrial:
    """One trial as the journal tells it."""

    episode: int
    attempts: int = 0
    live: set[str] = field(default_factory=set)
    outcome: Result | None = None
    is_lost: bool = False


@dataclass(slots=True)
class AuditedAttempt:
    """One attempt as the journal tells it; its state is live, lapsed, returned or answered."""

    issued: AttemptIssued
    state: str = "live"


class Audit:
    """Reads a journal entry by entry and raises at the first that breaks a promise.

    Args:
        entries: A journal's, from the first on.
        whole: Insist that every trial proposed is counted and the run is complete.
        quorum: The run may close episodes over trials without an outcome.
        robots: Evaluators whose trials must never be copied.

    Attributes:
        trials, attempts: By number and by token, after the last entry.
        epochs: Lives of the learner.

    Raises:
        BrokenError: Where a promise is broken.
    """

    def __init__(
        self,
        entries: Iterable[Entry],
        *,
        whole: bool = False,
        quorum: bool = False,
        robots: frozenset[str] = frozenset(),
    ) -> None:
        self.trials: dict[int, AuditedTrial] = {}
        self.attempts: dict[str, AuditedAttempt] = {}
        self.epochs = 0
        self.closed = 0
        self.ended: RunEnded | None = None
        self._open: range | None = None
        self._is_opened = self._is_held = self._is_confirming = False
        self._quorum = quorum
        self._robots = robots
        for index, entry in enumerate(entries):
            try:
                self._see(entry)
            except AssertionError as fault:
                raise BrokenError(f"entry {index}, {entry}: {fault}") from None
        if whole:
            self._expect_whole()

    @property
    def counted(self) -> dict[int, Result]:
        """Outcomes by trial number."""
        return {n: t.outcome for n, t in self.trials.items() if t.outcome is not None}

    def _expect_whole(self) -> None:
        missing = sorted(set(self.trials) - set(self.counted))
        if missing or self.ended is None or not self.ended.ok:
            raise BrokenError(f"the run is not whole: no outcome of {missing}, ended: {self.ended}")

    def _see(self, entry: Entry) -> None:
        assert self._is_opened != isinstance(entry, RunOpened), "a run opens once, first of all"
        _SEEN[type(entry)](self, entry)

    def _opened(self, _: RunOpened) -> None:
        self._is_opened = True

    def _booted(self, entry: LearnerBooted) -> None:
        assert entry.epoch == self.epochs + 1, "an epoch was used twice or left out"
        assert self.ended is None, "an ended run was taken up again"
        self.epochs = entry.epoch

    def _given_up(self, entry: AttemptLapsed | AttemptReturned) -> None:
        assert self._attempt(entry.token).state == "live", "what is not live was given up"
        self._end(entry.token, "lapsed" if isinstance(entry, AttemptLapsed) else "returned")

    def _lost(self, entry: TrialLost) -> None:
        trial = self._trial(entry.trial)
        assert trial.outcome is None, "a trial with an outcome was lost"
        assert not trial.live, "a trial was lost while an attempt of it was live"
        trial.is_lost = True

    def _ruled(self, entry: RunRuled) -> None:
        self._is_held = entry.kind is CommandKind.HOLD

    def _ended(self, entry: RunEnded) -> None:
        assert self.ended is None, "a run ended twice"
        self.ended = entry

    def _proposed(self, entry: TrialsProposed) -> None:
        assert self._open is None, "an episode opened before the one before it closed"
        assert entry.episode == self.closed, "episodes are out of order"
        is_learning = not isinstance(entry, ConfirmationProposed)
        assert not (is_learning and self._is_confirming), "learning went on after a confirmation"
        self._expect_going()
        numbers = [planned.trial for planned in entry.trials]
        first = len(self.trials)
        assert numbers == list(range(first, first + len(numbers))), "trial numbers have a gap"
        self._open = range(first, first + len(numbers))
        self.trials |= {number: AuditedTrial(entry.episode) for number in numbers}

    def _confirming(self, entry: ConfirmationProposed) -> None:
        assert self.closed, "a confirmation opened before anything was learned"
        self._is_confirming = True
        self._proposed(entry)

    def _issued(self, entry: AttemptIssued) -> None:
        trial = self._trial(entry.trial)
        self._expect_going()
        assert not self._is_held, "an attempt was handed out while the run was held"
        assert entry.token not in self.attempts, "a token was used twice"
        assert self._open is not None, "an attempt was handed out while no episode was open"
        assert entry.trial in self._open, "an attempt at a trial of another episode"
        assert trial.outcome is None, "a trial with an outcome was handed out again"
        assert not trial.is_lost, "a lost trial was handed out again"
        assert entry.attempt == trial.attempts + 1, "attempt numbers have a gap"
        assert entry.copy == bool(trial.live), "a copy is an attempt beside a live one"
        trial.attempts = entry.attempt
        self.attempts[entry.token] = AuditedAttempt(entry)
        self._go_live(entry.token, trial)

    def _revived(self, entry: AttemptRevived) -> None:
        attempt = self._attempt(entry.token)
        trial = self._trial(attempt.issued.trial)
        assert attempt.state == "lapsed", "what had not lapsed came back"
        assert trial.outcome is None, "an attempt came back at a trial with an outcome"
        assert not trial.live, "an attempt came back beside a live one"
        attempt.state = "live"
        self._go_live(entry.token, trial)

    def _resulted(self, entry: ResultTaken) -> None:
        attempt, result = self._attempt(entry.result.token), entry.result
        trial = self._trial(attempt.issued.trial)
        assert attempt.issued.evaluator == entry.evaluator, "a result of somebody else's attempt"
        assert attempt.issued.boot == result.boot, "a result by another life of its evaluator"
        assert attempt.issued.trial == result.trial, "a result names another trial"
        assert attempt.state != "answered", "a second result of one attempt was taken"
        self._end(result.token, "answered")
        decides = result.kind in JUDGED
        assert decides == (entry.verdict is not Verdict.NOTED), "an abort became an outcome"
        if entry.verdict in DECIDING:
            assert trial.outcome is None, "a trial was counted twice"
            is_open = self._open is not None and attempt.issued.trial in self._open
            on_time = is_open and not trial.is_lost
            assert on_time == (entry.verdict is Verdict.COUNTED), "late and counted are confused"
            assert math.isfinite(result.cost), "a cost is not finite"
            trial.outcome = result
        elif decides:
            assert trial.outcome is not None, "the first outcome of a trial was thrown away"

    def _closed(self, entry: EpisodeDone) -> None:
        said = entry.summary
        assert self._open is not None, "an episode closed that was not open"
        assert said.episode == self.closed, "episodes closed out of order"
        rows = [self.trials[number] for number in self._open]
        outcomes = [row.outcome for row in rows if row.outcome is not None]
        settled = len(outcomes) + sum(row.is_lost and row.outcome is None for row in rows)
        assert self._quorum or settled == len(rows), "an episode closed over open trials"
        won = sum(outcome.kind is OutcomeKind.SUCCESS for outcome in outcomes)
        assert (said.trials, said.successes) == (len(outcomes), won), "an episode is miscounted"
        self.closed, self._open = self.closed + 1, None

    # -- what several share ---------------------------------------------------------------------

    def _go_live(self, token: str, trial: AuditedTrial) -> None:
        trial.live.add(token)
        names = [self.attempts[live].issued.evaluator for live in trial.live]
        assert len(names) <= LIVE_MAX, f"{len(names)} live attempts of one trial"
        assert len(set(names)) == len(names), "two live attempts of a trial on one evaluator"
        assert len(names) == 1 or not self._robots.intersection(names), "a copy on a robot"

    def _end(self, token: str, state: str) -> None:
        attempt = self.attempts[token]
        attempt.state = state
        self.trials[attempt.issued.trial].live.discard(token)

    def _trial(self, number: int) -> AuditedTrial:
        assert number in self.trials, "a trial that nobody proposed"
        return self.trials[number]

    def _attempt(self, token: str) -> AuditedAttempt:
        assert token in self.attempts, "an attempt that was never handed out"
        return self.attempts[token]

    def _expect_going(self) -> None:
        assert self.epochs > 0, "work went out before the epoch was on record"
        assert self.ended is None, "work went out after the end"


_SEEN: Mapping[type[Entry], Callable[[Audit, Any], None]] = {
    RunOpened: Audit._opened,
    LearnerBooted: Audit._booted,
    TrialsProposed: Audit._proposed,
    ConfirmationProposed: Audit._confirming,
    AttemptIssued: Audit._issued,
    AttemptLapsed: Audit._given_up,
    AttemptReturned: Audit._given_up,
    AttemptRevived: Audit._revived,
    ResultTaken: Audit._resulted,
    TrialLost: Audit._lost,
    EpisodeDone: Audit._closed,
    RunRuled: Audit._ruled,
    RunEnded: Audit._ended,
}


def expect_kept(before: Sequence[Entry], after: Sequence[Entry]) -> None:
    """Assert that a journal has only grown: nothing acknowledged was changed or lost.

    Raises:
        BrokenError: If it was.
    """
    if list(after[: len(before)]) != list(before):
        raise BrokenError("the journal does not begin with what it held before")


def expect_founded(entries: Sequence[Entry], told: Iterable[Ack | Trial]) -> None:
    """Assert that whatever evaluators were told stood in the journal.

    Args:
        entries: The journal's, read after the messages were heard.
        told: Trials and acknowledgements that were overheard.

    Raises:
        BrokenError: If a trial went out, or a result was acknowledged, that is not on record.
    """
    issued = {e.token: e for e in entries if isinstance(e, AttemptIssued)}
    taken = {e.result.token: e for e in entries if isinstance(e, ResultTaken)}
    for message in told:
        if isinstance(message, Trial):
            if message.token not in issued:
                raise BrokenError(f"trial {message.trial} went out and is not on record")
        elif message.verdict is Verdict.DUPLICATE:
            if message.token not in taken:
                raise BrokenError(f"a duplicate of nothing was acknowledged: {message}")
        elif message.verdict is not Verdict.UNKNOWN:
            entry = taken.get(message.token)
            if entry is None or entry.verdict is not message.verdict:
                raise BrokenError(f"{message} does not stand on record: {entry}")
