"""The promises that need both ends of the wire, two epochs or true time to be seen.

What can be seen from the dispatcher's desk alone is in ``shearline.learner.dispatcher.checks``.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

from shearline.learner.dispatcher import Book, Entry, Rules
from shearline.learner.dispatcher.entries import (
    AttemptIssued,
    AttemptLapsed,
    AttemptRevived,
    EpisodeDone,
    LapseReason,
    LearnerBooted,
    ResultTaken,
    TrialsProposed,
)
from shearline.learner.dispatcher.events import Planned
from shearline.learner.dispatcher.instructions import Ask, Ending, EndRun, Instruction, Told
from shearline.protocol.messages import DECIDING, Ack, Verdict


class BrokenError(AssertionError):
    """A promise does not hold."""


def propose(episode: int, trials: int, told: list[Told], first: int) -> list[Planned]:
    """Stand in for a learner: proposals depend on everything told before, and on nothing else."""
    memory = hashlib.sha256(repr((episode, told)).encode()).digest()
    return [
        Planned(first + i, [int.from_bytes(memory[:4], "big") / 2**32 + i], 1000 + i)
        for i in range(trials)
    ]


class Promises:
    """Watches one run from outside.

    Args:
        rules: The run's.

    Attributes:
        journal: What was written, in order, over all epochs.
        jumps: How often the learner's clock was set; each may age a lease by a quarter.
    """

    def __init__(self, rules: Rules) -> None:
        self.rules = rules
        self.journal: list[Entry] = []
        self.jumps = 0
        self._acked: dict[str, ResultTaken] = {}
        self._epochs: set[int] = set()
        self._renewed: dict[str, tuple[float, int]] = {}

    # -- on the way -------------------------------------------------------------------------

    def decided(self, entry: Entry, now_s: float) -> None:
        """Look at an entry the moment it is carried out; ``now_s`` is the true time."""
        if isinstance(entry, LearnerBooted):
            if entry.epoch in self._epochs:
                raise BrokenError(f"two lives of the learner share epoch {entry.epoch}")
            self._epochs.add(entry.epoch)
        elif isinstance(entry, AttemptIssued):
            if entry.token in self._renewed:
                raise BrokenError("a token was issued twice")
            self._renewed[entry.token] = (now_s, self.jumps)
        elif isinstance(entry, AttemptRevived):
            self._renewed[entry.token] = (now_s, self.jumps)
        elif isinstance(entry, AttemptLapsed) and entry.reason is LapseReason.LEASE:
            since_s, jumps = self._renewed[entry.token]
            unseen_s = (self.jumps - jumps) * self.rules.lease_s / 4
            if now_s - since_s + unseen_s < self.rules.lease_s:
                raise BrokenError(f"given up {now_s - since_s:.2f} s after it was renewed")

    def renewed(self, tokens: Iterable[str], now_s: float) -> None:
        """Note that the learner heard a renewal."""
        for token in tokens:
            if token in self._renewed:
                self._renewed[token] = (now_s, self.jumps)

    def acknowledged(self, ack: Ack) -> None:
        """What is acknowledged is in the journal, at this moment and for ever."""
        if ack.verdict is Verdict.UNKNOWN or ack.token in self._acked:
            return
        for entry in reversed(self.journal):
            if isinstance(entry, ResultTaken) and entry.result.token == ack.token:
                self._acked[ack.token] = entry
                return
        raise BrokenError(f"acknowledged as {ack.verdict}, but not in the journal")

    # -- at the end -------------------------------------------------------------------------

    def kept(self, live: Book, finished: EndRun) -> None:
        """Look at the whole run.

        Args:
            live: The last dispatcher's book.
            finished: How the run ended.
        """
        book = Book.of(self.journal)
        if durable(book) != durable(live):
            raise BrokenError("the journal leads to another state than the one it was written from")
        kept = {e.result.token: e for e in self.journal if isinstance(e, ResultTaken)}
        if any(kept.get(token) is not entry for token, entry in self._acked.items()):
            raise BrokenError("an acknowledged result is gone")
        self._counted_once()
        self._nothing_wasted(book)
        self._in_order()
        patient = self.rules.losses_max == self.rules.aborts_max == 100
        if finished.ending is Ending.COMPLETE:
            confirming = sum(trials for _, trials in self.rules.confirming())
            asked = self.rules.episodes * self.rules.trials + confirming
            if book.tally.counted + book.tally.lost != asked or book.unsettled:
                raise BrokenError(f"{book.tally} is not every one of {asked} trials")
            if self.rules.quorum == 1.0 and patient:
                self._as_undisturbed(book)
        elif patient:
            raise BrokenError(f"the run failed: {finished.why}")

    def _counted_once(self) -> None:
        counted = [
            e.result.trial
            for e in self.journal
            if isinstance(e, ResultTaken) and e.verdict in DECIDING
        ]
        if len(counted) != len(set(counted)):
            raise BrokenError("a trial was counted twice")

    def _nothing_wasted(self, book: Book) -> None:
        """What was measured reached its trial: trials are dear on robots."""
        measured = {
            book.attempts[e.result.token].trial
            for e in self.journal
            if isinstance(e, ResultTaken) and e.verdict is not Verdict.NOTED
        }
        if any(book.trials[number].result is None for number in measured):
            raise BrokenError("a measured trial has no outcome")

    def _in_order(self) -> None:
        """No result of an episode counts before the one ahead of it has closed."""
        opened = closed = 0
        for entry in self.journal:
            opened += isinstance(entry, TrialsProposed)
            closed += isinstance(entry, EpisodeDone)
            if not closed <= opened <= closed + 1:
                raise BrokenError("an episode opened before the one ahead of it closed")

    def _as_undisturbed(self, book: Book) -> None:
        """A run in which nothing was lost proposed what an undisturbed one would have."""
        told: list[Told] = []
        first = episode = 0
        while (agenda := self.rules.agenda(episode)) is not None:
            _, trials = agenda
            for planned in propose(episode, trials, told, first):
                if book.trials[planned.trial].theta != planned.theta:
                    raise BrokenError(
                        f"trial {planned.trial} is not what an undisturbed run proposes"
                    )
            if episode < self.rules.episodes:
                told += book.told[episode]
            first, episode = first + trials, episode + 1


def learn_from_no_confirmation(out: Iterable[Instruction], proposed: int) -> None:
    """The learner hears of no trial but the ``proposed`` first, which are its own."""
    for instruction in out:
        if isinstance(instruction, Ask | EndRun) and any(
            tell.trial >= proposed for tell in instruction.tells
        ):
            raise BrokenError("the learner was told of a confirmation")


def durable(book: Book) -> dict[str, object]:
    """Return everything in a book that the journal alone decides."""
    return {name: value for name, value in vars(book).items() if name != "released"}
