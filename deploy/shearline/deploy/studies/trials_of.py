"""What the journal of one run holds, as outcomes: tuples, costs, engines, and what it took."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from shearline.learner.dispatcher.book import Book, TrialRow
from shearline.learner.run.folder import JOURNAL
from shearline.learner.run.journal import read
from shearline.protocol.messages import OutcomeKind, Purpose
from shearline.studies.experiment import Outcomes


@dataclass(frozen=True, slots=True)
class Ran:
    """The trials of one run that have an outcome.

    Attributes:
        rows: In order.
        purposes: What each was for.
    """

    rows: list[TrialRow]
    purposes: list[Purpose]

    def outcomes(self, purpose: Purpose) -> Outcomes:
        """Return the outcomes of one purpose, in order."""
        return outcomes(r for r, p in zip(self.rows, self.purposes, strict=True) if p is purpose)

    def cheapest(self) -> list[float]:
        """Return the tuple of the cheapest success that was learned from; empty if none was."""
        won = [
            (row.result.cost, row.number)
            for row, purpose in zip(self.rows, self.purposes, strict=True)
            if purpose is Purpose.LEARNING and _won(row) and row.result is not None
        ]
        return next((r.theta for r in self.rows if won and r.number == min(won)[1]), [])

    @property
    def trials_s(self) -> float:
        """What the trials took by their evaluators' clocks [s]."""
        return sum(row.result.wall_s for row in self.rows if row.result is not None)

    @property
    def engines(self) -> list[str]:
        """What ran the trials, each once."""
        return sorted({row.result.engine for row in self.rows if row.result is not None})


def ran(folder: Path) -> Ran:
    """Read a run's journal.

    Raises:
        RecordError: If it cannot be read.
    """
    book = Book.of(read(folder / JOURNAL))
    rows = [row for _, row in sorted(book.trials.items()) if row.result is not None]
    return Ran(rows, [book.purposes[row.episode] for row in rows])


def outcomes(rows: Iterable[TrialRow]) -> Outcomes:
    """Return rows with a result as outcomes."""
    pairs = [(_won(row), row.result.cost) for row in rows if row.result is not None]
    return Outcomes([won for won, _ in pairs], [cost for _, cost in pairs])


def _won(row: TrialRow) -> bool:
    return row.result is not None and row.result.kind is OutcomeKind.SUCCESS
