"""The dispatcher: events in, instructions out.

``handle`` takes one event and the time and returns what is to be done, in order. Nothing here
opens a connection, reads a clock or draws a random number: the same events at the same times with
the same tokens give the same instructions, on any machine. It does not know what a parameter
means or how a learner learns.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from shearline.learner.dispatcher import admission, episodes, handout, results
from shearline.learner.dispatcher.book import Book
from shearline.learner.dispatcher.desk import Desk
from shearline.learner.dispatcher.entries import LapseReason, LearnerBooted, RunRuled
from shearline.learner.dispatcher.events import (
    Begin,
    ByeReceived,
    CreditReceived,
    EvaluatorGone,
    Event,
    HelloReceived,
    LearnerFailed,
    OperatorCommand,
    ProposalsReady,
    RenewReceived,
    ResultReceived,
    Tick,
)
from shearline.learner.dispatcher.instructions import Broadcast, Ending, Instruction
from shearline.learner.dispatcher.rules import Rules
from shearline.learner.dispatcher.states import RUN, RunCause, RunState
from shearline.protocol.messages import Command, CommandKind, Refused, Verdict

#: Steps kept for a bug report: what came, when, and what was done about it.
STORY_MAX = 1024

#: Attempts given up in one tick: if half of a large crowd vanishes, the rest is for the next tick.
LAPSES_MAX = 256


class Dispatcher:
    """The state machine that hands a learner's trials to evaluators.

    Args:
        rules: What the run is judged by.
        token: Returns a new unguessable token each time, 8 to 64 characters.
        book: What the journal of earlier epochs led to; empty for a new run.

    Attributes:
        story: The last steps: stimulus number, time, event, instructions.
    """

    def __init__(self, rules: Rules, token: Callable[[], str], book: Book | None = None) -> None:
        self.desk = Desk(rules, token, Book() if book is None else book)
        self.story: deque[tuple[int, float, Event, tuple[Instruction, ...]]] = deque(
            maxlen=STORY_MAX
        )

    @property
    def book(self) -> Book:
        """The durable half of the state."""
        return self.desk.book

    @property
    def state(self) -> RunState:
        """Where the run stands."""
        return self.desk.state

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        """Advance by one event.

        Args:
            event: What happened.
            now_s: When, on any clock in seconds; going backwards or jumping does no harm.

        Returns:
            What is to be done, in this order. An acknowledgement stands after the journal entry
            it rests on: carry out nothing behind an entry that could not be written.
        """
        desk = self.desk
        desk.stimulus += 1
        desk.look(now_s)
        desk.out = []
        _HANDLERS[type(event)](desk, event)
        out = desk.out
        self.story.append((desk.stimulus, now_s, event, tuple(out)))
        return out


def _begin(desk: Desk, _event: Begin) -> None:
    """Take the run over: the epoch goes on record before anything goes out."""
    book = desk.book
    desk.journal(LearnerBooted(at_s=desk.now_s, stimulus=desk.stimulus, epoch=book.epoch + 1))
    desk.opened_s = desk.clock_s
    for attempt in book.live.values():
        desk.adopt(attempt)
    if book.episode is None:
        episodes.ask(desk)
    else:
        episodes.settle(desk)


def _tick(desk: Desk, _event: Tick) -> None:
    """Let time have its effects."""
    desk.count_crew()
    clock_s = desk.clock_s
    due = [t for t, lease in desk.leases.items() if clock_s > min(lease.until_s, lease.deadline_s)]
    for token in due[:LAPSES_MAX]:
        _lapse_due(desk, token, overdue=clock_s > desk.leases[token].deadline_s)
    if desk.state is not RunState.ENDED:
        episodes.settle(desk)
    handout.spread(desk)
    handout.speculate(desk)
    for evaluator in desk.roster:
        desk.show(evaluator)
    if desk.state is RunState.STOPPING:
        episodes.finish_stop(desk)


def _lapse_due(desk: Desk, token: str, *, overdue: bool) -> None:
    attempt = desk.book.attempts[token]
    desk.lapse(attempt, LapseReason.DEADLINE if overdue else LapseReason.LEASE)
    owner = desk.roster.get(attempt.evaluator)
    if owner is not None and owner.boot == attempt.boot:
        owner.strike(desk.clock_s, desk.rules.lease_s)


def _hello(desk: Desk, event: HelloReceived) -> None:
    admission.hello(desk, event)
    _moved(desk, event.evaluator)


def _credit(desk: Desk, event: CreditReceived) -> None:
    known = desk.roster.get(event.evaluator)
    if known is None or known.left:
        return
    if known.boot == event.message.boot:
        admission.credit(desk, known, event.message)
        _after(desk, event.evaluator)
    elif known.challenger is None or known.challenger.boot != event.message.boot:
        why = f"another process called {event.evaluator!r} took its place after a silence"
        desk.send(event.evaluator, Refused(boot=event.message.boot, why=why))


def _renew(desk: Desk, event: RenewReceived) -> None:
    results.renew(desk, event)
    known = desk.roster.get(event.evaluator)
    if known is not None and known.boot == event.message.boot:
        if desk.state is not RunState.RUNNING:
            admission.remind(desk, known)
        _after(desk, event.evaluator)


def _result(desk: Desk, event: ResultReceived) -> None:
    verdict = results.result(desk, event)
    if verdict is Verdict.UNKNOWN:
        return
    if desk.state is not RunState.ENDED and verdict is not Verdict.DUPLICATE:
        episodes.settle(desk)
    _after(desk, event.evaluator)
    if verdict is Verdict.NOTED:
        handout.spread(desk)
    if desk.state is RunState.STOPPING:
        episodes.finish_stop(desk)


def _bye(desk: Desk, event: ByeReceived) -> None:
    admission.bye(desk, event)
    _moved(desk, event.evaluator)


def _gone(desk: Desk, event: EvaluatorGone) -> None:
    admission.gone(desk, event)
    _moved(desk, event.evaluator)


def _moved(desk: Desk, name: str) -> None:
    """An evaluator came or went: what a boot held may go to others at once."""
    desk.count_crew()
    if desk.state is not RunState.ENDED:
        episodes.settle(desk)
    _after(desk, name)
    handout.spread(desk)
    if desk.state is RunState.STOPPING:
        episodes.finish_stop(desk)


def _proposals(desk: Desk, event: ProposalsReady) -> None:
    episodes.propose(desk, event)
    handout.spread(desk)


def _learner_failed(desk: Desk, event: LearnerFailed) -> None:
    if desk.state is not RunState.ENDED:
        episodes.dismiss(desk, Ending.FAILED, event.why)


def _command(desk: Desk, event: OperatorCommand) -> None:
    """Obey the operator, where the run's state allows it."""
    cause = RunCause(event.kind)
    if cause not in RUN[desk.state]:
        return
    if event.kind is CommandKind.STOP:
        episodes.stop(desk, event.why)
        episodes.finish_stop(desk)
        return
    if RUN[desk.state][cause] is not desk.state:
        desk.journal(RunRuled(at_s=desk.now_s, stimulus=desk.stimulus, kind=event.kind))
    desk.enter(cause)
    desk.out.append(Broadcast(Command(kind=event.kind, why=event.why)))
    desk.say(f"{event.kind}: {event.why or 'by the operator'}")
    for evaluator in desk.roster:
        evaluator.was_held = True
    handout.spread(desk)


def _after(desk: Desk, name: str) -> None:
    """Use the room an evaluator may now have, and tell observers where it stands."""
    evaluator = desk.roster.get(name)
    if evaluator is not None:
        handout.serve(desk, evaluator)
        desk.show(evaluator)


_HANDLERS: Mapping[type[Event], Callable[[Desk, Any], None]] = MappingProxyType(
    {
        Begin: _begin,
        Tick: _tick,
        HelloReceived: _hello,
        CreditReceived: _credit,
        RenewReceived: _renew,
        ResultReceived: _result,
        ByeReceived: _bye,
        EvaluatorGone: _gone,
        ProposalsReady: _proposals,
        LearnerFailed: _learner_failed,
        OperatorCommand: _command,
    }
)
