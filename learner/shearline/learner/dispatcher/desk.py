"""The desk: the whole state of a dispatcher, and the few primitive acts that change it.

Every durable change goes through :meth:`Desk.journal`, which puts the entry into the book and
asks for it to be written; whatever tells the world comes after. Leases and the roster are
volatile. Time is measured on an *observed* clock: it advances with the given time, but never by
more than a quarter of a lease at once and never backwards, so that a learner that was itself
stopped, or whose clock jumped, does not blame its evaluators.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from shearline.learner.dispatcher.book import AttemptRow, Book, TrialRow
from shearline.learner.dispatcher.entries import (
    AttemptIssued,
    AttemptLapsed,
    Entry,
    LapseReason,
)
from shearline.learner.dispatcher.instructions import (
    Instruction,
    Journal,
    Publish,
    Say,
    Send,
)
from shearline.learner.dispatcher.observed import messages
from shearline.learner.dispatcher.roster import Evaluator, Roster
from shearline.learner.dispatcher.rules import REJOIN_LEASES, TURNAROUNDS_MAX, Rules
from shearline.learner.dispatcher.states import RUN, RunCause, RunState, advance
from shearline.protocol.messages import EvaluatorState, Message, Trial
from shearline.protocol.task import digest

#: Trials of one evaluator that observers are told; most hold two.
TRIALS_SHOWN = 16


@dataclass(slots=True)
class Lease:
    """What is volatile about a live attempt, on the observed clock [s]."""

    issued_s: float
    until_s: float
    deadline_s: float


class Desk:
    """State and primitives.

    Args:
        rules: What the run is judged by.
        token: Returns a new unguessable token each time.
        book: What the journal of an earlier epoch led to.

    Attributes:
        is_observed: Whether there are observers to be told anything; it changes nothing else.
    """

    def __init__(self, rules: Rules, token: Callable[[], str], book: Book) -> None:
        self.rules = rules
        self.task_digest = digest(rules.task)
        self.token = token
        self.book = book
        self.roster = Roster(rules.lease_s)
        self.state = RunState.HELD if book.held else RunState.RUNNING
        self.leases: dict[str, Lease] = {}
        self.asking: int | None = None
        self.resends = 0
        self.unknown = 0
        self.turnarounds_s: deque[float] = deque(maxlen=TURNAROUNDS_MAX)
        self.opened_s = 0.0
        self.crew = 0
        self.stop_by_s = 0.0
        self.stop_why = ""
        self.stimulus = 0
        self.now_s = 0.0
        self.clock_s = 0.0
        self.out: list[Instruction] = []
        self.is_observed = True
        self._seen_s: float | None = None

    # -- time -------------------------------------------------------------------------------

    def look(self, now_s: float) -> None:
        """Take note of the time, at most a quarter of a lease at once."""
        passed_s = 0.0 if self._seen_s is None else now_s - self._seen_s
        self._seen_s = self.now_s = now_s
        self.clock_s += min(max(passed_s, 0.0), self.rules.lease_s / 4)

    # -- effects ----------------------------------------------------------------------------

    def journal(self, entry: Entry) -> None:
        """Change the book, have the change written, and let observers know."""
        self.book.apply(entry)
        self.out.append(Journal(entry))
        if self.is_observed:
            for message in messages(self.book, entry):
                self.publish(message)

    def send(self, evaluator: str, message: Message) -> None:
        """Send to one evaluator."""
        self.out.append(Send(evaluator, message))

    def publish(self, message: Message) -> None:
        """Tell observers."""
        self.out.append(Publish(message))

    def say(self, text: str) -> None:
        """Write a line to the log, with the event that caused it."""
        self.out.append(Say(self.stimulus, text))

    def count_crew(self) -> None:
        """Count who could be handed something, room aside."""
        self.crew = len(self.roster.ready(self.clock_s))

    def enter(self, cause: RunCause) -> None:
        """Move the run to its next state."""
        self.state = advance(RUN, self.state, cause)

    def show(self, evaluator: Evaluator) -> None:
        """Tell observers where an evaluator stands, if that changed."""
        if not self.is_observed:
            return
        state = self.standing(evaluator)
        if state != evaluator.said:
            evaluator.said = state
            self.publish(self.describe(evaluator))

    def describe(self, evaluator: Evaluator) -> EvaluatorState:
        """Return where an evaluator stands."""
        held = list(self.book.held_by.get(evaluator.name, ()))
        left_s = [self.leases[token].until_s - self.clock_s for token in held]
        return EvaluatorState(
            evaluator=evaluator.name,
            state=self.standing(evaluator),
            kind=evaluator.kind,
            engine=evaluator.engine,
            running=len(held),
            trials=[self.book.attempts[token].trial for token in held[:TRIALS_SHOWN]],
            lease_s=max(min(left_s), 0.0) if held else None,
            done=evaluator.done,
            lost=evaluator.lost,
            at_s=self.now_s,
        )

    def standing(self, evaluator: Evaluator) -> str:
        """Return the word observers read: left, gone, silent, resting, busy or idle."""
        if evaluator.left:
            return "left"
        if evaluator.gone:
            return "gone"
        if not self.roster.is_heard(evaluator, self.clock_s):
            return "silent"
        if self.clock_s < evaluator.rests_until_s:
            return "resting"
        return "busy" if self.book.held_of(evaluator.name) else "idle"

    # -- attempts ---------------------------------------------------------------------------

    def issue(self, trial: TrialRow, evaluator: Evaluator, *, copy: bool = False) -> None:
        """Hand a trial out: on record first, then on its way."""
        rules, token = self.rules, self.token()
        ahead = self.book.held_of(evaluator.name) // evaluator.slots
        self.journal(
            AttemptIssued(
                at_s=self.now_s,
                stimulus=self.stimulus,
                trial=trial.number,
                attempt=trial.attempts + 1,
                token=token,
                evaluator=evaluator.name,
                boot=evaluator.boot,
                copy=copy,
                kind=evaluator.kind,
            )
        )
        self.leases[token] = Lease(
            self.clock_s,
            self.clock_s + rules.lease_s,
            self.clock_s + rules.lease_s + (ahead + 1) * rules.task.trial_s,
        )
        self.send(
            evaluator.name,
            Trial(
                boot=evaluator.boot,
                epoch=self.book.epoch,
                trial=trial.number,
                episode=trial.episode,
                attempt=trial.attempts,
                token=token,
                theta=trial.theta,
                seed=trial.seed,
                lease_s=rules.lease_s,
                deadline_s=rules.task.trial_s,
            ),
        )

    def adopt(self, attempt: AttemptRow) -> None:
        """Give a live attempt of an earlier epoch time to be heard of again."""
        rules = self.rules
        grace_s = REJOIN_LEASES * rules.lease_s
        held = self.book.held_of(attempt.evaluator)
        self.leases[attempt.token] = Lease(
            self.clock_s,
            self.clock_s + grace_s,
            self.clock_s + grace_s + held * rules.task.trial_s,
        )

    def lapse(self, attempt: AttemptRow, reason: LapseReason) -> None:
        """Stop waiting for an attempt."""
        self.journal(
            AttemptLapsed(
                at_s=self.now_s, stimulus=self.stimulus, token=attempt.token, reason=reason
            )
        )
        del self.leases[attempt.token]
        self.say(
            f"trial {attempt.trial} attempt {attempt.number} on {attempt.evaluator}"
            f" is given up: {reason}"
        )
