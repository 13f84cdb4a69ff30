"""Who gets what: from pending trials and free evaluators to attempts.

Prefetching stops when fewer trials are pending than evaluators could start at once, so that the
end of an episode is not spent waiting for a queue behind one busy evaluator. A trial that failed
on an evaluator goes to another one if there is any. What confirms may be meant for evaluators of
one kind; the others then get none of it, however long it waits.
"""

from __future__ import annotations

from itertools import islice
from statistics import median

from shearline.learner.dispatcher.book import UNSETTLED, AttemptRow, TrialRow
from shearline.learner.dispatcher.desk import Desk
from shearline.learner.dispatcher.roster import Evaluator
from shearline.learner.dispatcher.rules import SPECULATE_FACTOR, TURNAROUNDS_MIN
from shearline.learner.dispatcher.states import RunState

#: How far down the pending trials one evaluator is matched; bounds a step.
_MATCH_MAX = 64


def serve(desk: Desk, evaluator: Evaluator) -> None:
    """Hand one evaluator what it has room for."""
    while desk.book.pending and _room(desk, evaluator) > 0:
        trial = _match(desk, evaluator)
        if trial is None:
            return
        desk.issue(trial, evaluator)


def spread(desk: Desk) -> None:
    """Hand pending trials to all who have room, the least loaded first, one at a time."""
    served = True
    while desk.book.pending and served:
        served = False
        for evaluator in sorted(
            desk.roster.ready(desk.clock_s), key=lambda e: desk.book.held_of(e.name)
        ):
            if _room(desk, evaluator) > 0 and (trial := _match(desk, evaluator)) is not None:
                desk.issue(trial, evaluator)
                served = True


def speculate(desk: Desk) -> None:
    """Give idle evaluators one copy each of attempts that take far longer than most."""
    if not _may_speculate(desk):
        return
    limit_s = SPECULATE_FACTOR * median(desk.turnarounds_s)
    idle = [
        e
        for e in desk.roster.ready(desk.clock_s)
        if not e.is_robot() and desk.book.held_of(e.name) < e.slots
    ]
    for attempt in list(desk.book.live.values()):
        if not idle:
            return
        if desk.clock_s - desk.leases[attempt.token].issued_s > limit_s:
            _copy(desk, attempt, idle)


def _may_speculate(desk: Desk) -> bool:
    return (
        desk.rules.speculative
        and desk.state is RunState.RUNNING
        and not desk.book.pending
        and len(desk.turnarounds_s) >= TURNAROUNDS_MIN
    )


def _copy(desk: Desk, attempt: AttemptRow, idle: list[Evaluator]) -> None:
    """Copy one slow attempt to the first idle evaluator that has not failed on its trial."""
    trial = desk.book.trials[attempt.trial]
    owner = desk.roster.get(attempt.evaluator)
    if len(trial.live) > 1 or trial.state not in UNSETTLED or owner is None or owner.is_robot():
        return
    for evaluator in idle:
        fresh = evaluator.name != attempt.evaluator and evaluator.name not in trial.failed_on
        if fresh and _admits(desk, trial, evaluator):
            desk.issue(trial, evaluator, copy=True)
            idle.remove(evaluator)
            return


def _room(desk: Desk, evaluator: Evaluator) -> int:
    if desk.state is not RunState.RUNNING or not desk.roster.is_ready(evaluator, desk.clock_s):
        return 0
    plenty = len(desk.book.pending) >= desk.crew
    limit = evaluator.credits if plenty else min(evaluator.credits, evaluator.slots)
    return limit - desk.book.held_of(evaluator.name)


def _match(desk: Desk, evaluator: Evaluator) -> TrialRow | None:
    """Return the first pending trial that this evaluator should have."""
    trials, name = desk.book.trials, evaluator.name
    others: list[str] | None = None
    for number in islice(desk.book.pending, _MATCH_MAX):
        trial = trials[number]
        if not _admits(desk, trial, evaluator):
            continue
        if name not in trial.failed_on:
            return trial
        if others is None:
            ready = [e for e in desk.roster.ready(desk.clock_s) if e is not evaluator]
            others = [e.name for e in ready if _admits(desk, trial, e)]
        if all(other in trial.failed_on for other in others):
            return trial
    return None


def _admits(desk: Desk, trial: TrialRow, evaluator: Evaluator) -> bool:
    """Tell whether a trial is meant for evaluators of this kind."""
    return desk.rules.admits(desk.book.purposes[trial.episode], evaluator.kind)
