"""Goal: whatever happens in whatever order, the dispatcher does what a small model says.

The model knows no leases, queues or states: only whose each attempt is, which were answered, which
trials have their outcome, and what the learner was told. It is fed with what leaves the
dispatcher, and predicts every verdict.
"""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from simulation.lab import LEASE_S, Lab
from simulation.plants import PLANTS
from simulation.promises import durable

from shearline.learner.dispatcher import Book
from shearline.learner.dispatcher.events import (
    ByeReceived,
    CreditReceived,
    EvaluatorGone,
    Event,
    Planned,
    ProposalsReady,
    RenewReceived,
    ResultReceived,
    Tick,
)
from shearline.learner.dispatcher.instructions import (
    Ask,
    Ending,
    EndRun,
    Instruction,
    Publish,
    Send,
    Told,
)
from shearline.protocol.messages import (
    DECIDING,
    JUDGED,
    Ack,
    Bye,
    CommandKind,
    Counted,
    Credit,
    EpisodeClosed,
    OutcomeKind,
    Renew,
    Result,
    Trial,
    Verdict,
)

NAMES = ("a", "b", "c")
KINDS = {"a": "simulator", "b": "simulator", "c": "robot"}
TRIALS, EPISODES = 3, 2
#: Trials from here on only confirm what was recommended.
CONFIRMING_FROM = TRIALS * EPISODES

names = st.sampled_from(NAMES)
lives = st.integers(1, 2)


@dataclass
class Attempt:
    """What the model knows of an attempt."""

    trial: int
    evaluator: str
    boot: str
    answered: bool = False


class Model:
    """Whose attempts, which outcomes, what was told."""

    def __init__(self) -> None:
        self.attempts: dict[str, Attempt] = {}
        self.outcomes: dict[int, float] = {}
        self.done: set[int] = set()
        self.told: dict[int, float] = {}
        self.may_hand_out = True

    def verdict(self, name: str, result: Result) -> Verdict:
        """Predict what is done with a result."""
        attempt = self.attempts.get(result.token)
        if attempt is None or attempt.evaluator != name:
            return Verdict.UNKNOWN
        if attempt.answered:
            return Verdict.DUPLICATE
        if result.kind not in JUDGED:
            return Verdict.NOTED
        if attempt.trial in self.outcomes:
            return Verdict.DUPLICATE
        return Verdict.LATE if attempt.trial in self.done else Verdict.COUNTED

    def answer(self, result: Result, verdict: Verdict) -> None:
        """Take a result in."""
        if verdict is Verdict.UNKNOWN:
            return
        attempt = self.attempts[result.token]
        attempt.answered = True
        if verdict in DECIDING:
            self.outcomes[attempt.trial] = result.cost

    def see(self, instruction: Instruction) -> None:
        """Take in what leaves the dispatcher."""
        match instruction:
            case Send(name, Trial() as trial):
                assert self.may_hand_out, "handed out while held or stopped"
                assert trial.token not in self.attempts
                assert trial.trial not in self.done
                assert trial.trial not in self.outcomes
                self.attempts[trial.token] = Attempt(trial.trial, name, trial.boot)
            case Publish(Counted(kind=None, trial=number)):
                self.done.add(number)
            case Publish(EpisodeClosed(episode=episode)):
                self.done |= set(range(episode * TRIALS, (episode + 1) * TRIALS))
            case Ask(tells=tells):
                self.hear(tells)
            case _:
                pass

    def hear(self, tells: tuple[Told, ...]) -> None:
        """Take in what the learner is told: again after a restart, but never anything else."""
        assert list(tells) == sorted(tells, key=lambda told: told.trial)
        for told in tells:
            assert self.told.setdefault(told.trial, told.cost) == told.cost
            assert self.outcomes[told.trial] == told.cost
            assert told.trial < CONFIRMING_FROM


class DispatcherMachine(RuleBasedStateMachine):
    """Tells dispatcher and model the same."""

    @initialize(
        quorum=st.sampled_from((1.0, 0.5)),
        losses=st.integers(1, 3),
        speculative=st.booleans(),
        confirm=st.sampled_from((0, TRIALS)),
    )
    def begin(self, quorum: float, losses: int, speculative: bool, confirm: int) -> None:  # noqa: FBT001 - a rule's draw
        self.model = Model()
        self.asked: int | None = None
        self.ending: Ending | None = None
        self.stopped = False
        self.lab = Lab(
            trials=TRIALS,
            episodes=EPISODES,
            quorum=quorum,
            quorum_after_s=2 * LEASE_S,
            losses_max=losses,
            speculative=speculative,
            confirm=confirm,
        )
        self._see(self.lab.out)

    # -- what evaluators do -----------------------------------------------------------------

    @rule(name=names, life=lives, credits_=st.integers(0, 3))
    def hello(self, name: str, life: int, credits_: int) -> None:
        credits_ = min(credits_, 1) if KINDS[name] == "robot" else credits_
        self._see(self.lab.hello(name, boot_of(name, life), kind=KINDS[name], credits=credits_))

    @rule(name=names, life=lives, credits_=st.integers(0, 3), seq=st.integers(0, 50))
    def credit(self, name: str, life: int, credits_: int, seq: int) -> None:
        message = Credit(boot=boot_of(name, life), seq=seq, credits=credits_)
        self._do(CreditReceived(name, message))

    @rule(name=names, life=lives, data=st.data())
    def renew(self, name: str, life: int, data: st.DataObject) -> None:
        known = sorted(self.model.attempts)
        tokens = data.draw(st.lists(st.sampled_from([*known, "never-issued"]), max_size=3))
        self._do(RenewReceived(name, Renew(boot=boot_of(name, life), tokens=tokens)))

    @precondition(lambda self: self.model.attempts)
    @rule(data=st.data(), kind=st.sampled_from(OutcomeKind), cost=st.integers(0, 9))
    def report(self, data: st.DataObject, kind: OutcomeKind, cost: int) -> None:
        token = data.draw(st.sampled_from(sorted(self.model.attempts)))
        attempt = self.model.attempts[token]
        self._report(attempt.evaluator, attempt.boot, token, kind, float(cost))

    @precondition(lambda self: self.model.attempts)
    @rule(data=st.data(), name=names, life=lives)
    def forge(self, data: st.DataObject, name: str, life: int) -> None:
        known = sorted(t for t, a in self.model.attempts.items() if a.evaluator != name)
        token = data.draw(st.sampled_from([*known, "never-issued"]))
        written = len(self.lab.journal)
        self._report(name, boot_of(name, life), token, OutcomeKind.SUCCESS, -1.0)
        assert len(self.lab.journal) == written

    @rule(name=names, life=lives, goodbye=st.booleans())
    def part(self, name: str, life: int, goodbye: bool) -> None:  # noqa: FBT001 - a rule's draw
        boot = boot_of(name, life)
        self._do(ByeReceived(name, Bye(boot=boot)) if goodbye else EvaluatorGone(name, boot))

    # -- what else happens ------------------------------------------------------------------

    @rule(passing_s=st.sampled_from((0.1, 0.5, 0.5, 3600.0, -7200.0)), times=st.integers(1, 12))
    def let_time_pass(self, passing_s: float, times: int) -> None:
        for _ in range(times):
            self.lab.now_s += passing_s
            self._do(Tick())

    @rule(wrong=st.integers(0, 5))
    def propose(self, wrong: int) -> None:
        episode = self.asked if self.asked is not None and wrong else wrong
        trials = range(episode * TRIALS, (episode + 1) * TRIALS)
        answer = ProposalsReady(episode, [Planned(n, [n / 8], n) for n in trials])
        written = len(self.lab.journal)
        self._do(answer)
        if episode != self.asked:
            assert len(self.lab.journal) == written
        else:
            self.asked = None

    @precondition(lambda self: self.ending is None and not self.stopped)
    @rule(kind=st.sampled_from((CommandKind.HOLD, CommandKind.RESUME)))
    def command(self, kind: CommandKind) -> None:
        self.model.may_hand_out = kind is CommandKind.RESUME
        self._see(self.lab.command(kind))

    @precondition(lambda self: self.ending is None)
    @rule(really=st.sampled_from((False,) * 9 + (True,)))
    def stop(self, really: bool) -> None:  # noqa: FBT001 - a rule's draw
        if really:
            self.stopped, self.model.may_hand_out, self.asked = True, False, None
            self._see(self.lab.command(CommandKind.STOP))

    @precondition(lambda self: self.ending in {None, Ending.STOPPED})
    @rule(really=st.sampled_from((False,) * 4 + (True,)))
    def restart(self, really: bool) -> None:  # noqa: FBT001 - a rule's draw
        if really:
            self._restart()

    # -- what must hold ---------------------------------------------------------------------

    @invariant()
    def outcomes_agree(self) -> None:
        if hasattr(self, "lab"):
            rows = self.lab.dispatcher.book.trials.items()
            assert {n: r.result.cost for n, r in rows if r.result} == self.model.outcomes

    @invariant()
    def the_journal_leads_to_the_book(self) -> None:
        if hasattr(self, "lab"):
            assert durable(Book.of(self.lab.journal)) == durable(self.lab.dispatcher.book)

    def teardown(self) -> None:
        """Let nothing more go wrong: the run ends, and the learner was told everything once."""
        if not hasattr(self, "lab"):
            return
        if self.ending in {None, Ending.STOPPED}:
            self._restart()
            self.model.may_hand_out = True
            self._see(self.lab.command(CommandKind.RESUME))
            self._see(self.lab.hello("z", credits=1))
        for _ in range(400):
            if self.ending not in {None, Ending.STOPPED}:
                break
            self._help()
        assert self.ending in {Ending.COMPLETE, Ending.FAILED}
        told = set(self.model.told)
        assert told <= set(self.model.outcomes)

    def _help(self) -> None:
        if self.asked is not None:
            self.propose(1)
        for token in list(self.lab.dispatcher.book.held_by.get("z", ())):
            self._report("z", "boot-of-z", token, OutcomeKind.SUCCESS, 1.0)
        self.lab.now_s += LEASE_S / 8
        self._see(self.lab.credit("z", 1))
        self._do(Tick())

    # -- both at once -----------------------------------------------------------------------

    def _restart(self) -> None:
        self.ending, self.asked, self.stopped = None, None, False
        self.model.may_hand_out = not Book.of(self.lab.journal).held
        self._see(self.lab.boot())

    def _do(self, event: Event) -> list[Instruction]:
        out = self.lab.do(event)
        self._see(out)
        return out

    def _see(self, out: list[Instruction]) -> None:
        for instruction in out:
            self.model.see(instruction)
            if isinstance(instruction, Ask):
                self.asked = instruction.episode
            if isinstance(instruction, EndRun):
                self.ending, self.asked, self.model.may_hand_out = instruction.ending, None, False
                self.model.hear(instruction.tells)
                learned = {n for n in self.model.outcomes if n < CONFIRMING_FROM}
                assert set(self.model.told) == learned

    def _report(self, name: str, boot: str, token: str, kind: OutcomeKind, cost: float) -> None:
        result = Result(boot=boot, token=token, trial=0, kind=kind, cost=cost, seed=0)
        expected = self.model.verdict(name, result)
        self.model.answer(result, expected)
        out = self._do(ResultReceived(name, result))
        (ack,) = [i.message for i in out if isinstance(i, Send) and isinstance(i.message, Ack)]
        assert ack == Ack(boot=boot, token=token, verdict=expected)


def boot_of(name: str, life: int) -> str:
    """Return the boot of one of two processes that have the same name."""
    return f"boot-{life}-of-{name}"


def run(examples: int, phases: tuple[Phase, ...] = tuple(Phase)) -> None:
    """Run the machine."""
    chosen = settings(max_examples=examples, stateful_step_count=40, phases=phases, database=None)
    run_state_machine_as_test(DispatcherMachine, settings=chosen)


def test_whatever_happens_is_what_the_model_says() -> None:
    run(40)


@pytest.mark.slow
def test_whatever_happens_is_what_the_model_says_for_long() -> None:
    run(500)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "no dedupe",
        "tokens believed from anyone",
        "late results thrown away",
        "handing out after stop",
    ],
)
def test_a_planted_bug_contradicts_the_model(name: str) -> None:
    with PLANTS[name].planted(), pytest.raises((AssertionError, KeyError, ValueError)):
        run(1000, (Phase.generate,))
