"""A world small enough to look at all of it: every state, not a sample.

Two evaluators, three trials in two episodes, one learner that may be killed between any two of
its effects. The network keeps all it was ever given and delivers any of it at any time, any
number of times, or never: whatever delay, loss, duplication and reordering can do is among that.
Evaluators are reduced to what the dispatcher can tell apart: a result exists of every attempt
that was sent while the life it was meant for lasted, for it may have been received and run; and
with each lease that passes, each evaluator was silent, idle, or renewed one or all it holds. The
dispatcher is the real one.
"""

from __future__ import annotations

import enum
import itertools
import pickle
from collections.abc import Iterator
from typing import NamedTuple

from simulation.plants import NONE, Plant
from simulation.promises import BrokenError, durable, learn_from_no_confirmation
from simulation.small_state import (
    LEASE_S,
    NAMES,
    STEP_S,
    Bounds,
    Frozen,
    Outside,
    State,
    boot_of,
    key_of,
)

from shearline.learner.dispatcher import Book, Dispatcher, Entry, Rules
from shearline.learner.dispatcher.checks import check, check_desk
from shearline.learner.dispatcher.desk import Desk
from shearline.learner.dispatcher.entries import AttemptIssued, LearnerBooted, ResultTaken
from shearline.learner.dispatcher.events import (
    Begin,
    ByeReceived,
    CreditReceived,
    EvaluatorGone,
    Event,
    HelloReceived,
    OperatorCommand,
    Planned,
    ProposalsReady,
    RenewReceived,
    ResultReceived,
    Tick,
)
from shearline.learner.dispatcher.instructions import Ask, Instruction, Journal, Send
from shearline.learner.dispatcher.rules import TURNAROUNDS_MIN
from shearline.learner.dispatcher.states import ANSWERED, RunState
from shearline.protocol.messages import (
    VERSION,
    Ack,
    Bye,
    CommandKind,
    Credit,
    Hello,
    OutcomeKind,
    Renew,
    Result,
    Trial,
    Verdict,
)
from shearline.protocol.task import TaskSpec

#: Steps after which what was not renewed has lapsed.
SILENCE_STEPS = 5


class Sign(enum.StrEnum):
    """What is heard of an evaluator while a lease passes."""

    NONE = "silent"
    LIFE = "idle"  # of what it was sent, nothing arrived
    ONE = "one"  # only the first arrived
    ALL = "all"


class Move(NamedTuple):
    """Something that can happen next: what changes outside, then what the learner hears."""

    label: str
    outside: Outside
    events: tuple[Event, ...]
    signs: tuple[Sign, ...] | None = None


class SmallWorld:
    """Tells which states follow a state, and asserts the promises on the way.

    Args:
        bounds: How much of everything there is.
        plant: A bug to have.
    """

    def __init__(self, bounds: Bounds, plant: Plant = NONE) -> None:
        self.bounds = bounds
        self.plant = plant
        task = TaskSpec(name="small", space={"x": ("", 0.0, 1.0)}, trial_s=bounds.trial_s)
        self.rules = Rules(
            task,
            len(bounds.trials),
            max(bounds.trials),
            LEASE_S,
            losses_max=2,
            aborts_max=2,
            confirm=bounds.confirm,
        )
        self._are_alike = len(set(zip(bounds.credits, bounds.kinds, strict=True))) == 1
        self._tokens = 0
        self._machine = Dispatcher(self.rules, self._token)

    def first(self) -> State:
        """Return the state in which the learner has just started and nobody is there."""
        bounds = self.bounds
        outside = Outside(
            boots=(1, 1),
            sent=frozenset(),
            asked=None,
            stopped=False,
            restarts=bounds.restarts,
            leases=bounds.leases,
            kills=bounds.kills,
            aborts=bounds.aborts,
            stops=bounds.stops,
        )
        return self._booted((), outside)

    def after(self, state: Frozen) -> Iterator[tuple[str, int, State]]:
        """Yield every state that one move leads to: how, its key, and the state."""
        here = self.thaw(state)
        self._refuse_forgeries(here.desk, state.outside)
        moves = list(self._moves(here.desk, state.outside))
        own, worn = key_of(here), self.thaw(state)
        for move in moves:
            out = self._heard(worn.desk, move)
            after = self._asserted(worn, here.desk.book, move, out)
            yield move.label, self.key_of(after), after
            yield from self._killed(state, move, out, after.outside.restarts)
            # What is as it was may be used again: most moves change nothing.
            if _writes(out) or key_of(after) != own:
                worn = self.thaw(state)

    def key_of(self, state: State) -> int:
        """Return what tells a state from all others that matter.

        Of two evaluators that are alike it does not matter which is which: a state and its mirror
        image have the same key.
        """
        key = key_of(state)
        return min(key, key_of(state, mirrored=True)) if self._are_alike else key

    def freeze(self, state: State) -> Frozen:
        """Return a state as a value that nothing changes."""
        facts = {k: v for k, v in vars(state.desk).items() if k not in {"rules", "token", "out"}}
        return Frozen(pickle.dumps(facts, pickle.HIGHEST_PROTOCOL), *state[1:])

    def thaw(self, state: Frozen) -> State:
        """Return a state that may be changed, and is nobody else's."""
        desk = Desk.__new__(Desk)
        vars(desk).update(pickle.loads(state.desk))
        desk.rules, desk.token, desk.out = self.rules, self._token, []
        return State(desk, *state[1:])

    # -- what can happen --------------------------------------------------------------------

    def _moves(self, desk: Desk, outside: Outside) -> Iterator[Move]:
        yield from self._arrivals(outside)
        yield from self._results(desk, outside)
        yield from self._ends(outside)
        yield from self._leases(desk, outside)
        if outside.asked is not None and outside.asked == desk.asking:
            yield Move("proposals arrive", outside, (self._proposals(outside.asked),))
        if outside.stops and desk.state is RunState.RUNNING:
            stopped = outside._replace(stops=outside.stops - 1, stopped=True)
            yield Move("stop", stopped, (OperatorCommand(CommandKind.STOP),))

    def _arrivals(self, outside: Outside) -> Iterator[Move]:
        """Yield every hello that was ever said, and what tells of every life that ended."""
        for name, boots in zip(NAMES, outside.boots, strict=True):
            for number in range(1, boots + 1):
                yield Move(f"hello {name} {number}", outside, (self._hello(name, number),))
            for number in range(1, boots):
                boot = boot_of(name, number)
                yield Move(f"gone {boot}", outside, (EvaluatorGone(name, boot),))
                yield Move(f"bye {boot}", outside, (ByeReceived(name, Bye(boot=boot)),))

    def _results(self, desk: Desk, outside: Outside) -> Iterator[Move]:
        """Yield every result there may be, and every renewal that may still be on its way."""
        for token in outside.sent:
            attempt = desk.book.attempts.get(token)
            if attempt is None:
                continue
            name, boot = attempt.evaluator, attempt.boot
            success = _result(token, boot, OutcomeKind.SUCCESS)
            yield Move(f"result {token}", outside, (ResultReceived(name, success),))
            if attempt.state in ANSWERED:
                continue
            renew = RenewReceived(name, Renew(boot=boot, tokens=[token]))
            yield Move(f"renew {token}", outside, (renew,))
            if outside.aborts:
                less = outside._replace(aborts=outside.aborts - 1)
                aborted = _result(token, boot, OutcomeKind.ABORTED)
                yield Move(f"abort {token}", less, (ResultReceived(name, aborted),))

    def _ends(self, outside: Outside) -> Iterator[Move]:
        """Yield every end of an evaluator, with the first that is heard of it.

        An end that nobody has heard of can be put off: what follows upon it, silence, may follow
        upon none as well. The next life of the evaluator begins at once.
        """
        for index, name in enumerate(NAMES if outside.kills else ()):
            a, b = outside.boots
            boots = (a + 1, b) if index == 0 else (a, b + 1)
            after = outside._replace(boots=boots, kills=outside.kills - 1)
            ended = boot_of(name, outside.boots[index])
            yield Move(f"{ended} ends, gone", after, (EvaluatorGone(name, ended),))
            yield Move(f"{ended} ends, bye", after, (ByeReceived(name, Bye(boot=ended)),))
            yield Move(f"{ended} ends, hello", after, (self._hello(name, boots[index]),))

    def _leases(self, desk: Desk, outside: Outside) -> Iterator[Move]:
        """Yield every way in which a lease may pass."""
        if not outside.leases:
            return
        less = outside._replace(leases=outside.leases - 1)
        choices = []
        for name, number in zip(NAMES, outside.boots, strict=True):
            known, held = desk.roster.get(name), len(desk.book.held_by.get(name, ()))
            welcome = known is not None and known.boot == boot_of(name, number) and not known.left
            signs = (Sign.NONE, Sign.LIFE, Sign.ALL, Sign.ONE)[: 2 + min(held, 2)]
            choices.append(signs if welcome else (Sign.NONE,))
        for signs in itertools.product(*choices):
            yield Move(f"a lease passes: {', '.join(signs)}", less, (), signs)

    def _hello(self, name: str, number: int) -> HelloReceived:
        index = NAMES.index(name)
        hello = Hello(
            boot=boot_of(name, number),
            version=VERSION,
            task_digest="",
            kind=self.bounds.kinds[index],
            engine="small",
            credits=self.bounds.credits[index],
        )
        return HelloReceived(name, hello)

    def _proposals(self, episode: int) -> ProposalsReady:
        sizes = (*self.bounds.trials, self.bounds.confirm)
        first = sum(sizes[:episode])
        trials = range(first, first + sizes[episode])
        return ProposalsReady(episode, [Planned(n, [n / 8], n) for n in trials])

    # -- what comes of it -------------------------------------------------------------------

    def _asserted(self, state: State, before: Book, move: Move, out: list[Instruction]) -> State:
        """Return what a move led to, once its promises were looked at."""
        desk = state.desk
        journal, outside = self._carried(state.journal, move.outside, out)
        if not _writes(out):
            check_desk(desk)
            return State(desk, journal, outside)
        check(desk)
        _keep_outcomes(before, desk.book)
        _waste_nothing(desk.book, out)
        if not self.plant.forgotten and durable(Book.of(journal)) != durable(desk.book):
            raise BrokenError("the journal leads to another state than the one it was written from")
        return State(desk, journal, outside)

    def _killed(
        self, state: Frozen, move: Move, out: list[Instruction], restarts: int
    ) -> Iterator[tuple[str, int, State]]:
        """Yield where the learner stands if it is killed on the way and started again."""
        if not restarts or not _writes(out):
            return  # without an entry the book is as it was, and a kill now is a kill before
        less = move.outside._replace(restarts=restarts - 1)
        for cut in _cuts(out):
            after = self._booted(*self._carried(state.journal, less, out[:cut]))
            yield f"{move.label}, killed after {cut}", self.key_of(after), after

    def _heard(self, desk: Desk, move: Move) -> list[Instruction]:
        """Return all that the learner does about a move."""
        dispatcher = self._dispatcher(desk)
        now_s = desk.now_s
        out = [i for event in move.events for i in dispatcher.handle(event, now_s)]
        if move.signs is None:
            return out
        for _ in range(SILENCE_STEPS):
            now_s += STEP_S
            for event in self._signs(desk, move.signs, move.outside):
                out += dispatcher.handle(event, now_s)
            out += dispatcher.handle(Tick(), now_s)
        return out

    def _signs(self, desk: Desk, signs: tuple[Sign, ...], outside: Outside) -> Iterator[Event]:
        """Yield what is heard of the evaluators within a quarter of a lease."""
        for index, (name, sign) in enumerate(zip(NAMES, signs, strict=True)):
            known, boot = desk.roster.get(name), boot_of(name, outside.boots[index])
            if sign is Sign.NONE or known is None:
                continue
            live = [a for a in desk.book.live.values() if (a.evaluator, a.boot) == (name, boot)]
            held = [a.token for a in live if a.token in outside.sent][
                : 1 if sign is Sign.ONE else None
            ]
            if sign is Sign.LIFE or not held:
                credits_ = self.bounds.credits[index]
                yield CreditReceived(name, Credit(boot=boot, seq=known.seq + 1, credits=credits_))
            else:
                yield RenewReceived(name, Renew(boot=boot, tokens=held))

    def _carried(
        self, journal: tuple[Entry, ...], outside: Outside, out: list[Instruction]
    ) -> tuple[tuple[Entry, ...], Outside]:
        """Carry instructions out: into the journal, and to the outside."""
        written, sent, asked = list(journal), set(outside.sent), outside.asked
        learn_from_no_confirmation(out, sum(self.bounds.trials))
        if self.plant.ack_first:
            out = sorted(out, key=lambda instruction: isinstance(instruction, Journal))
        for instruction in out:
            match instruction:
                case Journal(entry):
                    if isinstance(entry, AttemptIssued) and outside.stopped:
                        raise BrokenError("an attempt was handed out after stop")
                    if type(entry) not in self.plant.forgotten:
                        written.append(entry)
                case Send(name, Trial() as trial):
                    if trial.boot == boot_of(name, outside.boots[NAMES.index(name)]):
                        sent.add(trial.token)
                case Send(_, Ack() as ack):
                    _acknowledged(ack, written)
                case Ask(episode):
                    asked = episode
                case _:
                    pass
        return tuple(written), outside._replace(sent=frozenset(sent), asked=asked)

    def _booted(self, journal: tuple[Entry, ...], outside: Outside) -> State:
        """Start a learner process on what the journal holds."""
        desk = Desk(self.rules, self._token, Book.of(journal))
        # As if episodes of quick trials had gone before: an attempt a step old is a slow one.
        desk.turnarounds_s.extend([0.0] * (TURNAROUNDS_MIN + sum(self.bounds.trials)))
        out = self._dispatcher(desk).handle(Begin(), 0.0)
        epochs = [entry.epoch for entry in journal if isinstance(entry, LearnerBooted)]
        if desk.book.epoch in epochs or len(epochs) != self.bounds.restarts - outside.restarts:
            raise BrokenError(f"two lives of the learner share epoch {desk.book.epoch}")
        check(desk)
        outside = outside._replace(asked=None, stopped=False)
        return State(desk, *self._carried(journal, outside, out))

    def _refuse_forgeries(self, desk: Desk, outside: Outside) -> None:
        """A token that was not issued to the evaluator has no effect."""
        dispatcher = self._dispatcher(desk)
        for token, attempt in desk.book.attempts.items():
            other = NAMES[attempt.evaluator == NAMES[0]]
            boot = boot_of(other, outside.boots[NAMES.index(other)])
            forged = _result(token, boot, OutcomeKind.FAILURE)
            out = dispatcher.handle(ResultReceived(other, forged), desk.now_s)
            if any(isinstance(instruction, Journal) for instruction in out):
                raise BrokenError("a token that was not issued to the evaluator had an effect")

    def _token(self) -> str:
        self._tokens += 1
        return f"token-{self._tokens:08d}"

    def _dispatcher(self, desk: Desk) -> Dispatcher:
        self._machine.desk = desk
        return self._machine


def _result(token: str, boot: str, kind: OutcomeKind) -> Result:
    """Return an attempt's result; each attempt has a cost of its own."""
    cost = 0.0 if kind is OutcomeKind.ABORTED else float(token[-8:])
    return Result(boot=boot, token=token, trial=0, kind=kind, cost=cost, seed=0)


def _writes(out: list[Instruction]) -> bool:
    return any(isinstance(instruction, Journal) for instruction in out)


def _cuts(out: list[Instruction]) -> list[int]:
    """Return after how many effects a kill can make a difference.

    What was sent may be delivered never, so only what is written matters: cut ahead of each entry
    but the first, and at the end.
    """
    entries = [n for n, instruction in enumerate(out) if isinstance(instruction, Journal)]
    return [*entries[1:], len(out)]


def _acknowledged(ack: Ack, written: list[Entry]) -> None:
    """What is acknowledged is in the journal."""
    if ack.verdict is not Verdict.UNKNOWN and not any(
        isinstance(entry, ResultTaken) and entry.result.token == ack.token for entry in written
    ):
        raise BrokenError(f"acknowledged as {ack.verdict}, but not in the journal")


def _keep_outcomes(before: Book, now: Book) -> None:
    """An outcome is never taken back and never changes."""
    for number, trial in before.trials.items():
        if trial.result is not None and now.trials[number].result != trial.result:
            raise BrokenError(f"the outcome of trial {number} changed")


def _waste_nothing(book: Book, out: list[Instruction]) -> None:
    """What was measured is its trial's outcome, unless the trial has one."""
    for instruction in out:
        if isinstance(instruction, Journal) and isinstance(instruction.entry, ResultTaken):
            taken = instruction.entry
            trial = book.attempts[taken.result.token].trial
            if taken.verdict is not Verdict.NOTED and book.trials[trial].result is None:
                raise BrokenError("a measured trial has no outcome")
