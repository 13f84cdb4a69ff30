"""The invariants that can be seen from the desk alone, to be asserted after any event.

Those that need both ends of the wire, or two epochs, are asserted by the simulated network.
"""

from __future__ import annotations

from shearline.learner.dispatcher.book import UNSETTLED, Book
from shearline.learner.dispatcher.desk import Desk
from shearline.learner.dispatcher.rules import ATTEMPTS_MAX, EVALUATORS_MAX, TURNAROUNDS_MAX
from shearline.learner.dispatcher.states import AttemptState, TrialState
from shearline.protocol.messages import Purpose

#: Live attempts that one trial may have at once.
LIVE_MAX = 2

_DONE = frozenset({TrialState.COUNTED, TrialState.LATE})


def check(desk: Desk) -> None:
    """Assert everything; linear in the size of the run, so meant for tests.

    Raises:
        AssertionError: If an invariant is broken.
    """
    _check_trials(desk.book)
    _check_attempts(desk.book)
    _check_outcomes(desk.book)
    check_desk(desk)


def check_desk(desk: Desk) -> None:
    """Assert what may change without an entry in the journal.

    Raises:
        AssertionError: If an invariant is broken.
    """
    _check_live(desk)
    assert len(desk.roster) <= EVALUATORS_MAX
    assert len(desk.turnarounds_s) <= TURNAROUNDS_MAX


def _check_trials(book: Book) -> None:
    """Every trial of the open episode is in one place; those of closed ones are settled."""
    pending = {n for n, t in book.trials.items() if t.state is TrialState.PENDING}
    assert pending == set(book.pending), "pending trials and their queue disagree"
    unsettled = [t for t in book.trials.values() if t.state in UNSETTLED]
    assert len(unsettled) == book.unsettled, "the open episode is miscounted"
    assert all(t.episode == book.episode for t in unsettled), "a closed episode is open"
    assert book.episode in {None, len(book.closed)}, "an episode opened before another closed"
    assert len(book.episodes) == len(book.closed) + (book.episode is not None)
    assert len(book.purposes) == len(book.episodes)
    for trial in book.trials.values():
        if trial.state in UNSETTLED:
            assert bool(trial.live) == (trial.state is TrialState.LEASED), f"trial {trial.number}"


def _check_attempts(book: Book) -> None:
    """The three views of what is live agree."""
    live = {t for t, a in book.attempts.items() if a.state is AttemptState.LEASED}
    assert live == set(book.live), "live attempts and their states disagree"
    assert live == {t for trial in book.trials.values() for t in trial.live}
    held = {(name, t) for name, tokens in book.held_by.items() for t in tokens}
    assert held == {(a.evaluator, a.token) for a in book.live.values()}


def _check_outcomes(book: Book) -> None:
    """No trial is counted twice; what was learned from, and nothing else, is told exactly once."""
    done = {n for n, t in book.trials.items() if t.state in _DONE}
    lost = {n for n, t in book.trials.items() if t.state in {TrialState.LOST, TrialState.LEFT}}
    assert all((t.result is not None) == (n in done) for n, t in book.trials.items())
    assert book.tally.counted == len(done), "trials with an outcome are miscounted"
    assert book.tally.lost == len(lost), "trials without one are miscounted"
    told = [tell.trial for batch in (*book.told, book.untold) for tell in batch]
    assert len(told) == len(set(told)), "an outcome was told twice"
    learning = {n for n in done if book.purposes[book.trials[n].episode] is Purpose.LEARNING}
    assert set(told) == learning, "outcomes and what was told disagree"
    decided = [a.trial for a in book.attempts.values() if a.state is AttemptState.DECIDED]
    assert sorted(decided) == sorted(done), "a trial was decided by other than one attempt"


def _check_live(desk: Desk) -> None:
    """At most two live attempts for each trial, on two evaluators, and one on robots."""
    book = desk.book
    assert desk.leases.keys() == book.live.keys(), "live attempts and their leases disagree"
    for attempt in book.live.values():
        trial = book.trials[attempt.trial]
        names = [book.attempts[token].evaluator for token in trial.live]
        assert len(names) <= LIVE_MAX, f"trial {trial.number} has {len(names)} live attempts"
        assert len(set(names)) == len(names), f"trial {trial.number} is twice on one evaluator"
        known = desk.roster.get(attempt.evaluator)
        assert known is None or not known.is_robot() or len(names) == 1, (
            f"trial {trial.number} is copied on a robot"
        )
        assert trial.attempts <= ATTEMPTS_MAX
        kind, purpose = attempt.kind or "", book.purposes[trial.episode]
        assert desk.rules.admits(purpose, kind), f"trial {trial.number} is not for a {kind!r}"
