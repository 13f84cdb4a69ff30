"""Bugs to plant: each breaks one promise, and the simulation must notice.

A plant either replaces something in the dispatcher for the time of a test, or changes how the
simulated learner process carries out instructions (``Process``).
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any
from unittest import mock

from shearline.learner.dispatcher import book, core, desk, handout, results
from shearline.learner.dispatcher.entries import (
    AttemptIssued,
    Entry,
    LearnerBooted,
    ResultTaken,
    TrialsProposed,
)
from shearline.learner.dispatcher.events import ResultReceived
from shearline.learner.dispatcher.states import AttemptState, RunState, TrialState
from shearline.protocol.messages import Purpose, Verdict


@dataclass(frozen=True)
class Plant:
    """One planted bug.

    Attributes:
        replaced: ``(module, attribute)`` to what stands there instead.
        forgotten: Kinds of entries that are carried out but never written.
        ack_first: Whether messages leave before the journal is written.
    """

    replaced: Mapping[tuple[Any, str], object] = field(default_factory=dict)
    forgotten: tuple[type[Entry], ...] = ()
    ack_first: bool = False

    @contextlib.contextmanager
    def planted(self) -> Iterator[None]:
        """Have the bug for as long as the block lasts."""
        with contextlib.ExitStack() as stack:
            for (module, name), instead in self.replaced.items():
                stack.enter_context(mock.patch.object(module, name, instead))
            yield


NONE = Plant()


_KEEP_NOTHING = {
    **dict.fromkeys(TrialState, Verdict.DUPLICATE),
    **dict.fromkeys((TrialState.PENDING, TrialState.LEASED), Verdict.COUNTED),
}


def _nothing(*_: object, **__: object) -> None:
    return None


def _yes(*_: object, **__: object) -> bool:
    return True


_true_room: Callable[[Any, Any], int] = handout._room
_true_revivable: Callable[[Any, Any], bool] = results._is_revivable

_true_open: Callable[[Any, Any, Purpose], None] = book.Book._open

_true_result: Callable[[Any, Any], Verdict] = results.result


def _room_after_stop(desk: Any, evaluator: Any) -> int:
    was, desk.state = desk.state, RunState.RUNNING
    try:
        return _true_room(desk, evaluator)
    finally:
        desk.state = was


def _revive_anything(_desk: Any, attempt: Any) -> bool:
    return bool(attempt.state is AttemptState.LAPSED)


def _believe_the_clock(desk: Any, now_s: float) -> None:
    desk.now_s = desk.clock_s = now_s


def _copy_to_anyone(desk: Any, attempt: Any, idle: list[Any]) -> None:
    for evaluator in idle:
        desk.issue(desk.book.trials[attempt.trial], evaluator, copy=True)
    idle.clear()


def _learn_from_everything(its: Any, entry: Any, _purpose: Purpose) -> None:
    _true_open(its, entry, Purpose.LEARNING)


def _believe_any_sender(desk: Any, event: Any) -> Verdict:
    attempt = desk.book.attempts.get(event.message.token)
    sender = event.evaluator if attempt is None else attempt.evaluator
    return _true_result(desk, ResultReceived(sender, event.message))


PLANTS: Mapping[str, Plant] = {
    "no dedupe": Plant(
        {
            (results, "_VERDICTS"): dict.fromkeys(TrialState, Verdict.COUNTED),
            (results, "ANSWERED"): frozenset(),
        }
    ),
    "acknowledged before the journal": Plant(ack_first=True),
    "epoch not persisted": Plant(forgotten=(LearnerBooted,)),
    "lapsed leases not given out again": Plant({(core, "_lapse_due"): _nothing}),
    "proposals not persisted": Plant(forgotten=(TrialsProposed,)),
    "attempts not persisted": Plant(forgotten=(AttemptIssued,)),
    "results not persisted": Plant(forgotten=(ResultTaken,)),
    "tokens believed from anyone": Plant({(results, "result"): _believe_any_sender}),
    "late results thrown away": Plant({(results, "_VERDICTS"): _KEEP_NOTHING}),
    "handing out after stop": Plant({(handout, "_room"): _room_after_stop}),
    "reviving what was given out again": Plant({(results, "_is_revivable"): _revive_anything}),
    "the clock believed": Plant({(desk.Desk, "look"): _believe_the_clock}),
    "learning from confirmations": Plant({(book.Book, "_open"): _learn_from_everything}),
    "confirming on anyone": Plant({(handout, "_admits"): _yes}),
    "copies for anyone": Plant({(handout, "_copy"): _copy_to_anyone}),
}
