"""A dispatcher on the bench: say what happens in one line, see what it does."""

from __future__ import annotations

import itertools
from typing import TypeVar

from shearline.learner.dispatcher import Book, Dispatcher, Entry, Rules, check
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
from shearline.learner.dispatcher.instructions import (
    Instruction,
    Journal,
    Publish,
    Say,
    Send,
)
from shearline.protocol.messages import (
    VERSION,
    Ack,
    Bye,
    CommandKind,
    Credit,
    Hello,
    Message,
    OutcomeKind,
    Renew,
    Result,
    Trial,
    Verdict,
)
from shearline.protocol.task import TaskSpec

LEASE_S = 2.0
TASK = TaskSpec(name="bench", space={"x": ("", 0.0, 1.0)}, trial_s=8.0)

M = TypeVar("M", bound=Message)


class Lab:
    """One dispatcher, its journal, and everything it ever sent.

    Args:
        trials: Trials of each episode.
        episodes: Episodes of the run.
        rules: Further rules.
    """

    def __init__(self, trials: int = 4, episodes: int = 2, **rules: object) -> None:
        self.rules = Rules(TASK, episodes, trials, LEASE_S, **rules)  # type: ignore[arg-type]
        self.now_s = 1000.0
        self.journal: list[Entry] = []
        self.out: list[Instruction] = []
        self._numbers = itertools.count()
        self._seq = itertools.count()
        self.boot()

    def boot(self) -> list[Instruction]:
        """Start a learner process on what the journal holds."""
        self.dispatcher = Dispatcher(self.rules, self._token, Book.of(self.journal))
        return self.do(Begin())

    def do(self, event: Event) -> list[Instruction]:
        """Handle one event now, with all invariants asserted after it."""
        out = self.dispatcher.handle(event, self.now_s)
        self.journal += [i.entry for i in out if isinstance(i, Journal)]
        self.out += out
        check(self.dispatcher.desk)
        return out

    def _token(self) -> str:
        return f"token-{next(self._numbers):08d}"

    # -- what happens -----------------------------------------------------------------------

    def propose(self, episode: int = 0, trials: int | None = None) -> list[Instruction]:
        """Have the learner answer."""
        n = self.rules.trials if trials is None else trials
        planned = [Planned(episode * n + i, [i / n], 100 + i) for i in range(n)]
        return self.do(ProposalsReady(episode, planned))

    def hello(self, name: str, boot: str = "", **changes: object) -> list[Instruction]:
        """Have an evaluator introduce itself."""
        fields: dict[str, object] = {
            "boot": boot or f"boot-of-{name}",
            "version": VERSION,
            "task_digest": "",
            "kind": "function",
            "engine": "bench",
            "credits": 2,
            **changes,
        }
        return self.do(HelloReceived(name, Hello(**fields)))  # type: ignore[arg-type]

    def credit(
        self, name: str, credits_: int = 2, boot: str = "", seq: int | None = None
    ) -> list[Instruction]:
        """Have an evaluator announce how much it will hold."""
        number = next(self._seq) if seq is None else seq
        message = Credit(boot=boot or f"boot-of-{name}", seq=number, credits=credits_)
        return self.do(CreditReceived(name, message))

    def renew(self, name: str, *tokens: str, boot: str = "") -> list[Instruction]:
        """Have an evaluator renew leases."""
        message = Renew(boot=boot or f"boot-of-{name}", tokens=list(tokens))
        return self.do(RenewReceived(name, message))

    def result(
        self,
        name: str,
        token: str,
        kind: OutcomeKind = OutcomeKind.SUCCESS,
        cost: float = 1.0,
        why: str = "",
    ) -> list[Instruction]:
        """Have an evaluator report."""
        result = Result(
            boot=f"boot-of-{name}", token=token, trial=0, kind=kind, cost=cost, seed=1, why=why
        )
        return self.do(ResultReceived(name, result))

    def bye(self, name: str, boot: str = "") -> list[Instruction]:
        """Have an evaluator leave."""
        return self.do(ByeReceived(name, Bye(boot=boot or f"boot-of-{name}")))

    def gone(self, name: str, boot: str = "") -> list[Instruction]:
        """Have the network miss an evaluator."""
        return self.do(EvaluatorGone(name, boot or f"boot-of-{name}"))

    def command(self, kind: CommandKind, why: str = "") -> list[Instruction]:
        """Have the operator say something."""
        return self.do(OperatorCommand(kind, why))

    def wait(self, passing_s: float, *alive: str) -> list[Instruction]:
        """Let time pass in small ticks; ``alive`` evaluators renew what they hold meanwhile."""
        out: list[Instruction] = []
        end_s = self.now_s + passing_s
        while self.now_s < end_s - 1e-9:
            self.now_s = min(self.now_s + LEASE_S / 8, end_s)
            for name in alive:
                out += self.renew(name, *self.dispatcher.book.held_by.get(name, ()))
            out += self.do(Tick())
        return out

    def finish(self, name: str, cost: float = 1.0) -> None:
        """Have an evaluator succeed at everything it holds, and at what it gets for that."""
        while held := list(self.dispatcher.book.held_by.get(name, ())):
            self.result(name, held[0], cost=cost)

    # -- what it did ------------------------------------------------------------------------

    def given(self, name: str, out: list[Instruction] | None = None) -> list[Trial]:
        """Return the attempts handed to an evaluator, ever or in ``out``."""
        return sent(self.out if out is None else out, Trial, name)

    def holds(self, name: str) -> list[int]:
        """Return the numbers of the trials of which an evaluator has a live attempt."""
        book = self.dispatcher.book
        return [book.attempts[token].trial for token in book.held_by.get(name, ())]


def sent(out: list[Instruction], kind: type[M], name: str | None = None) -> list[M]:
    """Return the messages of one kind sent to one evaluator, or to anyone."""
    return [
        i.message
        for i in out
        if isinstance(i, Send) and isinstance(i.message, kind) and name in {None, i.evaluator}
    ]


def published(out: list[Instruction], kind: type[M]) -> list[M]:
    """Return the messages of one kind for observers."""
    return [i.message for i in out if isinstance(i, Publish) and isinstance(i.message, kind)]


def verdicts(out: list[Instruction]) -> list[Verdict]:
    """Return what was acknowledged."""
    return [ack.verdict for ack in sent(out, Ack)]


def said(out: list[Instruction]) -> str:
    """Return the log lines, joined."""
    return "\n".join(i.text for i in out if isinstance(i, Say))
