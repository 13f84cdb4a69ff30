"""What observers hear of the book: messages as a function of its entries.

Because nothing but the entry and the book behind it decides them, a record that lost its tail is
completed from the journal with the very same messages.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from shearline.learner.dispatcher.book import Book, TrialRow
from shearline.learner.dispatcher.entries import (
    Entry,
    EpisodeDone,
    ResultTaken,
    TrialLost,
    TrialsProposed,
)
from shearline.learner.dispatcher.states import TrialState
from shearline.protocol.messages import DECIDING, Counted, Message, Proposed, Verdict


def history(entries: Iterable[Entry]) -> Iterator[Message]:
    """Yield everything that observers were, or should have been, told about trials and episodes.

    Args:
        entries: A journal's, from the first on.
    """
    book = Book()
    for entry in entries:
        book.apply(entry)
        yield from messages(book, entry)


def messages(book: Book, entry: Entry) -> list[Message]:
    """Return what observers hear of one entry.

    Args:
        book: The book with the entry applied.
        entry: The newest entry.
    """
    if isinstance(entry, ResultTaken):
        return _of_result(book, entry)
    if isinstance(entry, TrialsProposed):
        purpose = book.purposes[entry.episode]
        return [
            Proposed(
                trial=p.trial, episode=entry.episode, theta=p.theta, seed=p.seed, purpose=purpose
            )
            for p in entry.trials
        ]
    if isinstance(entry, TrialLost):
        return [_lost(book, book.trials[entry.trial], entry.why, entry.at_s)]
    if isinstance(entry, EpisodeDone):
        left = [r for r in book.rows(entry.summary.episode) if r.state is TrialState.LEFT]
        why = "its episode closed without it"
        return [*(_lost(book, row, why, entry.at_s) for row in left), entry.summary]
    return []


def _of_result(book: Book, entry: ResultTaken) -> list[Message]:
    if entry.verdict not in DECIDING:
        return []
    result = entry.result
    attempt = book.attempts[result.token]
    trial = book.trials[attempt.trial]
    return [
        Counted(
            trial=trial.number,
            episode=trial.episode,
            theta=trial.theta,
            kind=result.kind,
            cost=result.cost,
            seed=result.seed,
            evaluator=entry.evaluator,
            attempts=trial.attempts,
            late=entry.verdict is Verdict.LATE,
            engine=result.engine,
            digest=result.digest,
            wall_s=result.wall_s,
            why=result.why,
            extras=result.extras,
            at_s=entry.at_s,
            purpose=book.purposes[trial.episode],
            evaluator_kind=attempt.kind or "",
        )
    ]


def _lost(book: Book, trial: TrialRow, why: str, at_s: float) -> Counted:
    return Counted(
        trial=trial.number,
        episode=trial.episode,
        theta=trial.theta,
        kind=None,
        cost=0.0,
        seed=trial.seed,
        evaluator="",
        attempts=trial.attempts,
        late=False,
        engine="",
        digest="",
        wall_s=0.0,
        why=why,
        extras={},
        at_s=at_s,
        purpose=book.purposes[trial.episode],
    )
