"""One state of the small world, and what tells two of them apart.

Times count from now and no further than they matter, tokens are named by trial and attempt.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from shearline.learner.dispatcher import Entry
from shearline.learner.dispatcher.desk import Desk
from shearline.learner.dispatcher.roster import Evaluator
from shearline.learner.dispatcher.states import RunState

#: A lease of 4 s makes the largest step of the observed clock 1 s: all times are whole numbers.
LEASE_S, STEP_S = 4.0, 1.0

#: Who has been silent for so long is silent; longer makes no difference [s].
SILENT_S = 1.5 * LEASE_S + 1.0

#: A deadline this far ahead is never reached [s].
FAR_S = 100.0


class Bounds(NamedTuple):
    """How much of everything there is.

    Attributes:
        trials: Trials of each episode.
        credits: Of each evaluator.
        kinds: Of each evaluator.
        trial_s: After so long an attempt that is renewed for ever is given up [s].
        restarts: Kills of the learner, each followed by a new one.
        leases: Leases that pass.
        kills: Evaluators that end, to be started anew.
        aborts: Deliveries of a result without a verdict.
        stops: Stops by the operator; a stopped run is taken up again by a restart.
        confirm: Trials behind the last episode that the learner is not told of.
    """

    trials: tuple[int, ...] = (2, 1)
    credits: tuple[int, int] = (2, 1)
    kinds: tuple[str, str] = ("simulator", "simulator")
    trial_s: float = 1000.0
    restarts: int = 1
    leases: int = 2
    kills: int = 1
    aborts: int = 0
    stops: int = 0
    confirm: int = 0


class Outside(NamedTuple):
    """All there is besides the dispatcher; the counts are what is left of the bounds.

    Attributes:
        boots: Number of each evaluator's present life.
        sent: Tokens of attempts that left the learner while their evaluator's life lasted.
        asked: Episode that the learner was asked for in this epoch.
        stopped: Whether the run was stopped in this epoch.
    """

    boots: tuple[int, int]
    sent: frozenset[str]
    asked: int | None
    stopped: bool
    restarts: int
    leases: int
    kills: int
    aborts: int
    stops: int


class State(NamedTuple):
    """One state of the world."""

    desk: Desk
    journal: tuple[Entry, ...]
    outside: Outside


class Frozen(NamedTuple):
    """A state at rest: its desk is bytes."""

    desk: bytes
    journal: tuple[Entry, ...]
    outside: Outside


def key_of(state: State, *, mirrored: bool = False) -> int:
    """Return a 64-bit hash of all that can decide what follows, and of nothing else.

    In the mirror each evaluator is called what the other one is. The journal is not part of it:
    that it leads to the desk's book is asserted elsewhere.
    """
    return hash(_facts(state.desk, state.outside, _MIRRORED if mirrored else _PLAIN))


def boot_of(name: str, number: int) -> str:
    """Return the boot of one life of an evaluator."""
    return f"boot-{name}-{number}"


NAMES = ("a", "b")

#: Lives of one evaluator that the tables below have room for.
LIVES_MAX = 9

#: What evaluators and their boots are called, plainly and in the mirror.
_PLAIN = {name: name for name in NAMES}
_MIRRORED = dict(zip(NAMES, NAMES[::-1], strict=True))
for _names in (_PLAIN, _MIRRORED):
    _names |= {
        boot_of(name, number): boot_of(called, number)
        for name, called in _names.items()
        for number in range(1, LIVES_MAX + 1)
    }


def _facts(desk: Desk, outside: Outside, called: Mapping[str, str]) -> tuple[object, ...]:
    """Return them, named the same whatever the order of events: tokens by trial and attempt."""
    book, clock_s = desk.book, desk.clock_s
    name = {token: (a.trial, a.number) for token, a in book.attempts.items()}
    attempts = tuple(
        sorted(
            (name[t], called[a.evaluator], called[a.boot], a.copy, a.state, a.overdue)
            for t, a in book.attempts.items()
        )
    )
    trials = tuple(
        (t.state, t.attempts, t.losses, t.aborts, tuple(name[x] for x in t.live),
         tuple(sorted(called[e] for e in t.failed_on)), t.result and name[t.result.token])
        for t in book.trials.values()
    )  # fmt: skip
    leases = tuple(
        (
            name[token],
            max(lease.until_s - clock_s, -1.0),
            min(max(lease.deadline_s - clock_s, -1.0), FAR_S),
            lease.issued_s < clock_s,
        )
        for token, lease in desk.leases.items()
    )
    sent = frozenset(name.get(token, (-1, -1)) for token in outside.sent)
    return (
        book.epoch, trials, attempts, tuple(book.pending), book.episode, len(book.closed),
        book.ended is None, book.held, len(book.told), tuple(t.trial for t in book.untold),
        desk.state, desk.asking, desk.crew, leases,
        max(desk.stop_by_s - clock_s, 0.0) if desk.state is RunState.STOPPING else 0.0,
        tuple(_evaluator(e, clock_s, called) for e in desk.roster),
        sent,
        (outside.boots if called is _PLAIN else outside.boots[::-1], *outside[2:]),
    )  # fmt: skip


def _evaluator(
    evaluator: Evaluator, clock_s: float, called: Mapping[str, str]
) -> tuple[object, ...]:
    challenger = evaluator.challenger
    return (
        called[evaluator.name], called[evaluator.boot], evaluator.credits, evaluator.strikes,
        evaluator.gone, evaluator.left, evaluator.was_held,
        min(clock_s - evaluator.heard_s, SILENT_S),
        max(evaluator.rests_until_s - clock_s, 0.0),
        challenger and (
            called[challenger.boot],
            evaluator.heard_s > challenger.since_s + LEASE_S,
            min(clock_s - challenger.since_s, LEASE_S + 1.0),
        ),
    )  # fmt: skip
