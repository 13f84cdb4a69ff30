"""The book: everything durable that the dispatcher knows, as a fold over journal entries.

``apply`` is the only way to change it, live and at replay alike, so that the same journal gives
the same book. It knows no evaluators as processes, no leases and no clock: those are rebuilt from
what peers say after a restart.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from msgspec import UNSET, UnsetType

from shearline.learner.dispatcher.entries import (
    AttemptIssued,
    AttemptLapsed,
    AttemptReturned,
    AttemptRevived,
    ConfirmationProposed,
    Entry,
    EpisodeDone,
    LapseReason,
    LearnerBooted,
    ResultTaken,
    RunEnded,
    RunOpened,
    RunRuled,
    TrialLost,
    TrialsProposed,
)
from shearline.learner.dispatcher.instructions import Told
from shearline.learner.dispatcher.states import (
    ATTEMPT,
    TRIAL,
    AttemptCause,
    AttemptState,
    TrialCause,
    TrialState,
    advance,
)
from shearline.protocol.messages import (
    DECIDING,
    CommandKind,
    EpisodeClosed,
    OutcomeKind,
    Purpose,
    Result,
    Verdict,
)

#: States in which a trial of the open episode still keeps it open.
UNSETTLED = frozenset({TrialState.PENDING, TrialState.LEASED})


@dataclass(slots=True)
class TrialRow:
    """One trial: what was proposed, where it stands, and its outcome once it has one."""

    number: int
    episode: int
    theta: list[float]
    seed: int
    state: TrialState = TrialState.PENDING
    attempts: int = 0
    losses: int = 0
    aborts: int = 0
    live: list[str] = field(default_factory=list)
    failed_on: list[str] = field(default_factory=list)
    why: str = ""
    result: Result | None = None


@dataclass(slots=True)
class AttemptRow:
    """One attempt: whose it is and where it stands."""

    token: str
    trial: int
    number: int
    evaluator: str
    boot: str
    copy: bool
    state: AttemptState = AttemptState.LEASED
    overdue: bool = False
    kind: str | UnsetType = UNSET


@dataclass(slots=True)
class Tally:
    """How many trials, or results, came to what.

    Attributes:
        counted: Trials with an outcome, the late ones among them.
        late: Trials whose outcome came after they had been lost or left.
        lost: Trials without an outcome that are no longer waited for.
        surplus: Results of second attempts at trials that had their outcome.
        aborted: Aborted attempts, except those that our own stop aborted.
        rejected: Rejected attempts.
    """

    counted: int = 0
    late: int = 0
    lost: int = 0
    surplus: int = 0
    aborted: int = 0
    rejected: int = 0


class Book:
    """Trials, attempts and episodes of one run."""

    def __init__(self) -> None:
        self.opened: RunOpened | None = None
        self.ended: RunEnded | None = None
        self.held = False
        self.epoch = 0
        self.trials: dict[int, TrialRow] = {}
        self.attempts: dict[str, AttemptRow] = {}
        #: Trials to hand out, in the order they will be; released ones go first again.
        self.pending: OrderedDict[int, None] = OrderedDict()
        #: Live attempts, oldest first, over all and by evaluator.
        self.live: dict[str, AttemptRow] = {}
        self.held_by: dict[str, dict[str, None]] = {}
        #: The open episode, how many of its trials keep it open, and the trials of every episode.
        self.episode: int | None = None
        self.unsettled = 0
        self.episodes: list[list[int]] = []
        #: What every episode is for.
        self.purposes: list[Purpose] = []
        #: Trials that went back to pending and were not looked at since.
        self.released: list[int] = []
        self.closed: list[EpisodeClosed] = []
        #: Outcomes the learner was told before each next ask, and those it was not told yet.
        self.told: list[tuple[Told, ...]] = []
        self.untold: list[Told] = []
        self.tally = Tally()

    @classmethod
    def of(cls, entries: Iterable[Entry]) -> Book:
        """Return the book that these entries lead to."""
        book = cls()
        for entry in entries:
            book.apply(entry)
        return book

    def apply(self, entry: Entry) -> None:
        """Advance by one entry."""
        _APPLY[type(entry)](self, entry)

    def tells(self) -> tuple[Told, ...]:
        """Return what the learner has not heard yet, by trial number."""
        return tuple(sorted(self.untold, key=lambda told: told.trial))

    def rows(self, episode: int) -> list[TrialRow]:
        """Return the trials of an episode, in order."""
        return [self.trials[number] for number in self.episodes[episode]]

    def held_of(self, evaluator: str) -> int:
        """Return how many live attempts an evaluator has."""
        return len(self.held_by.get(evaluator, ()))

    # -- one method for each entry ----------------------------------------------------------

    def _opened(self, entry: RunOpened) -> None:
        self.opened = entry

    def _booted(self, entry: LearnerBooted) -> None:
        self.epoch = entry.epoch

    def _proposed(self, entry: TrialsProposed) -> None:
        self._open(entry, Purpose.LEARNING)

    def _confirming(self, entry: ConfirmationProposed) -> None:
        self._open(entry, entry.purpose)

    def _open(self, entry: TrialsProposed, purpose: Purpose) -> None:
        self.episode = entry.episode
        self.purposes.append(purpose)
        self.episodes.append([planned.trial for planned in entry.trials])
        self.unsettled = len(entry.trials)
        for p in entry.trials:
            self.trials[p.trial] = TrialRow(p.trial, entry.episode, p.theta, p.seed)
            self.pending[p.trial] = None

    def _issued(self, entry: AttemptIssued) -> None:
        trial = self.trials[entry.trial]
        self._enter(trial, TrialCause.ISSUED)
        trial.attempts = entry.attempt
        attempt = AttemptRow(
            entry.token, entry.trial, entry.attempt, entry.evaluator, entry.boot, entry.copy
        )
        attempt.kind = entry.kind
        self.attempts[entry.token] = attempt
        self._go_live(attempt, trial)

    def _revived(self, entry: AttemptRevived) -> None:
        attempt = self.attempts[entry.token]
        trial = self.trials[attempt.trial]
        attempt.state = advance(ATTEMPT, attempt.state, AttemptCause.RENEWED)
        self._enter(trial, TrialCause.ISSUED)
        trial.losses -= 1
        trial.failed_on.remove(attempt.evaluator)
        self._go_live(attempt, trial)

    def _lapsed(self, entry: AttemptLapsed) -> None:
        attempt = self.attempts[entry.token]
        trial = self.trials[attempt.trial]
        attempt.state = advance(ATTEMPT, attempt.state, AttemptCause.LAPSED)
        attempt.overdue = entry.reason is LapseReason.DEADLINE
        trial.losses += 1
        trial.failed_on.append(attempt.evaluator)
        trial.why = f"attempt {attempt.number} on {attempt.evaluator}: {entry.reason}"
        self._end_live(attempt, trial)

    def _returned(self, entry: AttemptReturned) -> None:
        attempt = self.attempts[entry.token]
        attempt.state = advance(ATTEMPT, attempt.state, AttemptCause.RETURNED)
        self._end_live(attempt, self.trials[attempt.trial])

    def _resulted(self, entry: ResultTaken) -> None:
        attempt = self.attempts[entry.result.token]
        trial = self.trials[attempt.trial]
        attempt.state = advance(ATTEMPT, attempt.state, _attempt_cause(entry))
        if entry.verdict in DECIDING:
            self._count(trial, entry.result)
        elif entry.verdict is Verdict.DUPLICATE:
            self.tally.surplus += 1
        else:
            self._note(trial, attempt, entry)
        self._end_live(attempt, trial)

    def _lost(self, entry: TrialLost) -> None:
        trial = self.trials[entry.trial]
        self._enter(trial, TrialCause.EXHAUSTED)
        trial.why = entry.why
        self.tally.lost += 1

    def _closed(self, entry: EpisodeDone) -> None:
        for trial in self.rows(entry.summary.episode):
            self.tally.lost += trial.state in UNSETTLED
            self._enter(trial, TrialCause.CLOSED)
        self.episode = None
        self.closed.append(entry.summary)
        self.told.append(self.tells())
        self.untold = []

    def _ruled(self, entry: RunRuled) -> None:
        self.held = entry.kind is CommandKind.HOLD

    def _ended(self, entry: RunEnded) -> None:
        self.ended = entry

    # -- the steps they share ---------------------------------------------------------------

    def _enter(self, trial: TrialRow, cause: TrialCause) -> None:
        before = trial.state
        trial.state = advance(TRIAL, before, cause)
        if trial.state is TrialState.PENDING:
            self.pending[trial.number] = None
            self.pending.move_to_end(trial.number, last=False)
        elif before is TrialState.PENDING:
            del self.pending[trial.number]
        if before in UNSETTLED and trial.state not in UNSETTLED:
            self.unsettled -= 1

    def _go_live(self, attempt: AttemptRow, trial: TrialRow) -> None:
        trial.live.append(attempt.token)
        self.live[attempt.token] = attempt
        self.held_by.setdefault(attempt.evaluator, {})[attempt.token] = None

    def _end_live(self, attempt: AttemptRow, trial: TrialRow) -> None:
        """Take an attempt that has just ended off the live ones, if it was one of them."""
        if self.live.pop(attempt.token, None) is None:
            return
        trial.live.remove(attempt.token)
        held = self.held_by[attempt.evaluator]
        del held[attempt.token]
        if not held:
            del self.held_by[attempt.evaluator]
        if trial.state is TrialState.LEASED and not trial.live:
            self._enter(trial, TrialCause.RELEASED)
            self.released.append(trial.number)

    def _count(self, trial: TrialRow, result: Result) -> None:
        self._enter(trial, TrialCause.VERDICT)
        trial.result = result
        self.tally.counted += 1
        if trial.state is TrialState.LATE:
            self.tally.late += 1
            self.tally.lost -= 1
        if self.purposes[trial.episode] is Purpose.LEARNING:
            self.untold.append(Told(trial.number, result.cost, result.kind is OutcomeKind.SUCCESS))

    def _note(self, trial: TrialRow, attempt: AttemptRow, entry: ResultTaken) -> None:
        if entry.excused:
            return
        if entry.result.kind is OutcomeKind.ABORTED:
            self.tally.aborted += 1
        else:
            self.tally.rejected += 1
        trial.aborts += 1
        trial.failed_on.append(attempt.evaluator)
        trial.why = f"{entry.result.kind} by {attempt.evaluator}: {entry.result.why}"


def _attempt_cause(entry: ResultTaken) -> AttemptCause:
    if entry.verdict in DECIDING:
        return AttemptCause.DECIDES
    if entry.verdict is Verdict.DUPLICATE:
        return AttemptCause.SURPLUS
    if entry.result.kind is OutcomeKind.ABORTED:
        return AttemptCause.ABORTED
    return AttemptCause.REJECTED


_APPLY: dict[type[Entry], Callable[[Book, Any], None]] = {
    RunOpened: Book._opened,  # noqa: SLF001 - the table of the class's own methods
    LearnerBooted: Book._booted,  # noqa: SLF001
    TrialsProposed: Book._proposed,  # noqa: SLF001
    ConfirmationProposed: Book._confirming,  # noqa: SLF001
    AttemptIssued: Book._issued,  # noqa: SLF001
    AttemptRevived: Book._revived,  # noqa: SLF001
    AttemptLapsed: Book._lapsed,  # noqa: SLF001
    AttemptReturned: Book._returned,  # noqa: SLF001
    ResultTaken: Book._resulted,  # noqa: SLF001
    TrialLost: Book._lost,  # noqa: SLF001
    EpisodeDone: Book._closed,  # noqa: SLF001
    RunRuled: Book._ruled,  # noqa: SLF001
    RunEnded: Book._ended,  # noqa: SLF001
}
