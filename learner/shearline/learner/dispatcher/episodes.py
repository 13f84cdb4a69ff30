"""Episodes: asking for one, opening it, closing it, and the end of the run.

An episode closes when every trial of it has its outcome or is lost, or by configuration at a
quorum after a deadline. Outcomes reach the learner in one piece with the next ask, ordered by
trial number: the journal's order of arrival cannot change what it proposes.

Behind the last episode of learning there may be others that only confirm what the learner
recommends: handed out, counted and closed like any, but the learner is not told of them.
"""

from __future__ import annotations

import math

from shearline.learner.dispatcher.book import TrialRow
from shearline.learner.dispatcher.desk import Desk
from shearline.learner.dispatcher.entries import (
    ConfirmationProposed,
    EpisodeDone,
    RunEnded,
    TrialLost,
    TrialsProposed,
)
from shearline.learner.dispatcher.events import ProposalsReady
from shearline.learner.dispatcher.instructions import Ask, Broadcast, Ending, EndRun
from shearline.learner.dispatcher.rules import ATTEMPTS_MAX
from shearline.learner.dispatcher.states import RunCause, RunState, TrialState
from shearline.protocol.messages import (
    Command,
    CommandKind,
    EpisodeClosed,
    OutcomeKind,
    Purpose,
    clip,
)


def ask(desk: Desk) -> None:
    """Ask for the next episode, or end the run if there is none."""
    episode = len(desk.book.closed)
    agenda = desk.rules.agenda(episode)
    if agenda is None:
        desk.journal(RunEnded(at_s=desk.now_s, stimulus=desk.stimulus, ok=True, why=""))
        dismiss(desk, Ending.COMPLETE, "")
        return
    desk.asking = episode
    purpose, trials = agenda
    tells = desk.book.told[-1] if desk.book.told else ()
    desk.out.append(Ask(episode, trials, tells, len(desk.book.trials), purpose))


def propose(desk: Desk, event: ProposalsReady) -> None:
    """Open the episode that was asked for; any other answer is ignored."""
    if event.episode != desk.asking:
        return
    desk.asking = None
    desk.journal(_opened(desk, event))
    desk.opened_s = desk.clock_s
    _say_who_is_missing(desk, event.episode)
    settle(desk)  # nothing to confirm is confirmed at once


def _say_who_is_missing(desk: Desk, episode: int) -> None:
    """Say for whom an episode waits, if nobody of that kind is there."""
    purpose, kind = desk.book.purposes[episode], desk.rules.confirm_on
    there = any(desk.rules.admits(purpose, e.kind) for e in desk.roster.ready(desk.clock_s))
    if kind and purpose is Purpose.CONFIRMATION and not there:
        desk.say(f"the confirmation waits for a {kind}: start one, or stop the run")


def _opened(desk: Desk, event: ProposalsReady) -> TrialsProposed:
    at_s, stimulus, episode, trials = desk.now_s, desk.stimulus, event.episode, event.trials
    purpose, _ = desk.rules.agenda(episode) or (Purpose.LEARNING, 0)
    if purpose is Purpose.LEARNING:
        return TrialsProposed(at_s=at_s, stimulus=stimulus, episode=episode, trials=trials)
    return ConfirmationProposed(
        at_s=at_s, stimulus=stimulus, episode=episode, trials=trials, purpose=purpose
    )


def settle(desk: Desk) -> None:
    """Give up trials that used up their attempts, then close the episode if nothing is open."""
    book = desk.book
    while book.released:
        trial = book.trials[book.released.pop()]
        if trial.state is TrialState.PENDING and _is_exhausted(desk, trial):
            _lose(desk, trial)
    if book.episode is not None and (book.unsettled == 0 or _has_quorum(desk)):
        _close(desk, book.episode)


def stop(desk: Desk, why: str) -> None:
    """Hand out nothing more; what runs may finish within the grace."""
    if desk.state is RunState.STOPPING:
        return
    desk.enter(RunCause.STOP)
    desk.asking = None
    desk.stop_why = why or "stopped by the operator"
    desk.stop_by_s = desk.clock_s + desk.rules.stop_grace_s
    desk.out.append(Broadcast(Command(kind=CommandKind.STOP, why=desk.stop_why)))
    desk.say(f"stopping: {desk.stop_why}")


def finish_stop(desk: Desk) -> None:
    """End a stopping run once nothing runs or the grace is over; it can be resumed later."""
    if not desk.book.live or desk.clock_s >= desk.stop_by_s:
        dismiss(desk, Ending.STOPPED, desk.stop_why)


def dismiss(desk: Desk, ending: Ending, why: str) -> None:
    """Let go of everyone; what is on record decides whether the run can be resumed."""
    desk.enter(RunCause.END)
    desk.asking = None
    said = why or "the run is complete"
    desk.out.append(Broadcast(Command(kind=CommandKind.STOP, why=said)))
    desk.say(f"ended: {said}")
    last = desk.book.told[-1] if desk.book.told else ()
    desk.out.append(EndRun(ending=ending, why=why, tells=(*last, *desk.book.tells())))


def _fail(desk: Desk, why: str) -> None:
    """End the run for good: going on would only repeat it."""
    desk.journal(RunEnded(at_s=desk.now_s, stimulus=desk.stimulus, ok=False, why=clip(why)))
    dismiss(desk, Ending.FAILED, clip(why))


def _is_exhausted(desk: Desk, trial: TrialRow) -> bool:
    rules = desk.rules
    return (
        trial.losses >= rules.losses_max
        or trial.aborts >= rules.aborts_max
        or trial.attempts >= ATTEMPTS_MAX
    )


def _lose(desk: Desk, trial: TrialRow) -> None:
    why = f"given up after {trial.attempts} attempts; the last: {trial.why}"
    desk.journal(
        TrialLost(at_s=desk.now_s, stimulus=desk.stimulus, trial=trial.number, why=clip(why))
    )
    desk.say(f"trial {trial.number} is lost: {why}")


def _has_quorum(desk: Desk) -> bool:
    rules, book = desk.rules, desk.book
    if rules.quorum >= 1.0 or desk.clock_s - desk.opened_s < rules.quorum_after_s:
        return False
    rows = book.rows(len(book.closed))
    counted = sum(row.result is not None for row in rows)
    return counted >= max(1, math.ceil(rules.quorum * len(rows)))


def _close(desk: Desk, episode: int) -> None:
    rows, purpose = desk.book.rows(episode), desk.book.purposes[episode]
    summary = summarise(episode, rows, desk.now_s, purpose)
    desk.journal(EpisodeDone(at_s=desk.now_s, stimulus=desk.stimulus, summary=summary))
    name = f"episode {episode}" if purpose is Purpose.LEARNING else f"the trials of the {purpose}"
    desk.say(f"{name} closed: {summary.successes} of {summary.trials} succeeded")
    if summary.trials == 0 and purpose is Purpose.LEARNING:
        why = f"no trial of episode {episode} reached a verdict; trial {rows[-1].number} was"
        _fail(desk, f"{why} {rows[-1].why}: correct the task or its evaluators")
    elif desk.state is not RunState.STOPPING or desk.rules.agenda(episode + 1) is None:
        ask(desk)


def summarise(
    episode: int, rows: list[TrialRow], at_s: float, purpose: Purpose = Purpose.LEARNING
) -> EpisodeClosed:
    """Return what an episode came to, over the trials that have an outcome."""
    results = [row.result for row in rows if row.result is not None]
    won = [r.cost for r in results if r.kind is OutcomeKind.SUCCESS]
    return EpisodeClosed(
        episode=episode,
        trials=len(results),
        successes=len(won),
        success_rate=len(won) / len(results) if results else 0.0,
        mean_cost=math.fsum(r.cost for r in results) / len(results) if results else None,
        best_cost=min(won, default=None),
        at_s=at_s,
        purpose=purpose,
    )
