"""What comes back: renewals and results, judged by token and by nothing else.

A token says which attempt is meant and whose it is. A result with a token that was not issued to
the evaluator on whose key it came has no effect but an answer. The first success or failure of a
trial is its outcome, whichever attempt it is from and however late; everything after it is kept
as surplus or answered as a duplicate.
"""

from __future__ import annotations

from shearline.learner.dispatcher.admission import heard
from shearline.learner.dispatcher.book import AttemptRow, TrialRow
from shearline.learner.dispatcher.desk import Desk, Lease
from shearline.learner.dispatcher.entries import AttemptRevived, ResultTaken
from shearline.learner.dispatcher.events import RenewReceived, ResultReceived
from shearline.learner.dispatcher.roster import Evaluator
from shearline.learner.dispatcher.states import ANSWERED, ENDING, AttemptState, TrialState
from shearline.protocol.messages import DECIDING, JUDGED, Ack, OutcomeKind, Verdict

_VERDICTS = {
    TrialState.PENDING: Verdict.COUNTED,
    TrialState.LEASED: Verdict.COUNTED,
    TrialState.LOST: Verdict.LATE,
    TrialState.LEFT: Verdict.LATE,
    TrialState.COUNTED: Verdict.DUPLICATE,
    TrialState.LATE: Verdict.DUPLICATE,
}


def renew(desk: Desk, event: RenewReceived) -> None:
    """Prolong leases, and take back attempts that were given up too early."""
    name, message = event.evaluator, event.message
    known = desk.roster.get(name)
    if known is not None and known.boot == message.boot and not known.left:
        _noticed(desk, known)
    for token in message.tokens:
        attempt = desk.book.attempts.get(token)
        if attempt is None or attempt.evaluator != name or attempt.boot != message.boot:
            continue
        if attempt.state is AttemptState.LEASED:
            _prolong(desk, desk.leases[token])
        elif _is_revivable(desk, attempt):
            _revive(desk, attempt)
        if known is not None and known.boot == message.boot and not attempt.overdue:
            known.forgive()


def result(desk: Desk, event: ResultReceived) -> Verdict:
    """Judge a result, have it journaled, acknowledge it; return what was done with it."""
    name, message = event.evaluator, event.message
    attempt = desk.book.attempts.get(message.token)
    if attempt is None or attempt.evaluator != name:
        desk.unknown += 1
        return _acknowledge(desk, event, Verdict.UNKNOWN)
    if attempt.state in ANSWERED:
        # No sign of life: what was said before may be said again long after its sender died.
        desk.resends += 1
        return _acknowledge(desk, event, Verdict.DUPLICATE)
    known = desk.roster.get(name)
    if known is not None and known.boot == message.boot and not known.left:
        _noticed(desk, known)
        known.forgive()
    trial = desk.book.trials[attempt.trial]
    verdict = _verdict(trial, message.kind)
    _take(desk, event, verdict)
    _acknowledge(desk, event, verdict)
    if known is not None and verdict in DECIDING:
        known.done += 1
    elif verdict is Verdict.NOTED:
        desk.say(f"trial {trial.number} {message.kind} by {name}: {message.why or 'no reason'}")
    return verdict


def _noticed(desk: Desk, evaluator: Evaluator) -> None:
    """Note a sign of life; but the last words of the dead may overtake the news of its death.

    Who is taken for gone and is not says hello again, for it hears nothing.
    """
    if not evaluator.gone:
        heard(desk, evaluator)


def _take(desk: Desk, event: ResultReceived, verdict: Verdict) -> None:
    """Put a result into the book."""
    desk.journal(
        ResultTaken(
            at_s=desk.now_s,
            stimulus=desk.stimulus,
            evaluator=event.evaluator,
            verdict=verdict,
            result=event.message,
            excused=desk.state in ENDING,
        )
    )
    lease = desk.leases.pop(event.message.token, None)
    if lease is not None and verdict is Verdict.COUNTED:
        desk.turnarounds_s.append(desk.clock_s - lease.issued_s)


def _acknowledge(desk: Desk, event: ResultReceived, verdict: Verdict) -> Verdict:
    message = event.message
    desk.send(event.evaluator, Ack(boot=message.boot, token=message.token, verdict=verdict))
    return verdict


def _verdict(trial: TrialRow, kind: OutcomeKind) -> Verdict:
    verdict = _VERDICTS[trial.state]
    if kind not in JUDGED:
        return Verdict.NOTED
    return verdict


def _prolong(desk: Desk, lease: Lease) -> None:
    lease.until_s = desk.clock_s + desk.rules.lease_s


def _is_revivable(desk: Desk, attempt: AttemptRow) -> bool:
    """Tell whether a lapsed attempt may go on: its trial must not have been given out again."""
    return (
        attempt.state is AttemptState.LAPSED
        and not attempt.overdue
        and desk.book.trials[attempt.trial].state is TrialState.PENDING
    )


def _revive(desk: Desk, attempt: AttemptRow) -> None:
    desk.journal(AttemptRevived(at_s=desk.now_s, stimulus=desk.stimulus, token=attempt.token))
    rules = desk.rules
    desk.leases[attempt.token] = Lease(
        desk.clock_s,
        desk.clock_s + rules.lease_s,
        desk.clock_s + rules.lease_s + desk.book.held_of(attempt.evaluator) * rules.task.trial_s,
    )
    desk.say(f"trial {attempt.trial} attempt {attempt.number} on {attempt.evaluator} is back")
