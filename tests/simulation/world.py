"""A whole run in virtual time: learner process, journal, network, evaluators, and an adversary.

Everything is decided by one seed. The adversary kills, freezes, hangs and cuts off evaluators,
forges results, holds and resumes the run and kills the learner between any two of its effects.
After every event the invariants of the protocol are asserted; when the faults stop, the run must
end.
"""

from __future__ import annotations

import functools
import hashlib
import random

from simulation.evaluators import LEASE_S, SimEvaluator
from simulation.network import Clock, Network
from simulation.plants import NONE, Plant

from shearline.learner.dispatcher import Book, Dispatcher, Entry, Rules, check
from shearline.learner.dispatcher.entries import (
    AttemptIssued,
    EpisodeDone,
    LearnerBooted,
    ResultTaken,
    TrialsProposed,
)
from shearline.learner.dispatcher.events import (
    Begin,
    Event,
    OperatorCommand,
    Planned,
    ProposalsReady,
    ResultReceived,
    Tick,
)
from shearline.learner.dispatcher.instructions import (
    Ask,
    Broadcast,
    Ending,
    EndRun,
    Instruction,
    Journal,
    Send,
    Told,
)
from shearline.protocol.messages import (
    Ack,
    CommandKind,
    Message,
    OutcomeKind,
    Result,
    TaskSpec,
    Trial,
    Verdict,
)

FAULTS_S = 12.0
#: Far beyond what any run needs once faults stop: a minute of rest, three losses of each trial.
PATIENCE_S = 400.0
TICK_S = LEASE_S / 8
TASK = TaskSpec(name="sim", space={"x": ("", 0.0, 1.0)}, trial_s=8.0)


class BrokenError(AssertionError):
    """An invariant does not hold."""


def propose(episode: int, trials: int, told: list[Told]) -> list[Planned]:
    """Stand in for a learner: proposals depend on everything told before, and on nothing else."""
    memory = hashlib.sha256(repr((episode, told)).encode()).digest()
    return [
        Planned(episode * trials + i, [int.from_bytes(memory[:4], "big") / 2**32 + i], 1000 + i)
        for i in range(trials)
    ]


class World:
    """One run.

    Args:
        seed: Decides everything.
        plant: A bug to have.
    """

    def __init__(self, seed: int, plant: Plant = NONE) -> None:
        self.rng = random.Random(seed)
        self.plant = plant
        self.clock = Clock()
        self.network = Network(self.clock, self.rng)
        self.rules = Rules(
            task=TASK,
            episodes=self.rng.choice((1, 2, 3)),
            trials=self.rng.choice((2, 8, 20)),
            lease_s=LEASE_S,
            speculative=self.rng.random() < 0.7,
            quorum=self.rng.choice((1.0, 1.0, 0.5)),
            quorum_after_s=5.0,
            losses_max=self.rng.choice((3, 100)),
            aborts_max=self.rng.choice((3, 100)),
        )
        self.journal: list[Entry] = []
        self.acked: dict[str, ResultTaken] = {}
        self.epochs: list[int] = []
        self.tokens: set[str] = set()
        self.finished: EndRun | None = None
        self.events = 0
        self.up = False
        self.life = 0
        self.stopped = False
        kinds = ("simulator", "function", "robot")
        self.evaluators = {
            name: SimEvaluator(name, self.rng.choice(kinds), self.clock, self.network, self.rng)
            for name in ("a", "b", "c", "d")[: self.rng.choice((1, 2, 3, 4))]
        }
        for evaluator in self.evaluators.values():
            evaluator.learner = self
        self.calm_s = FAULTS_S
        self.crash_in = 0

    def run(self) -> None:
        """Let everything happen until the run ends.

        Raises:
            BrokenError: If it does not, or an invariant fails on the way.
        """
        self._boot()
        self.clock.after(self.rng.expovariate(3.0), self._fault)
        self.clock.after(FAULTS_S, self._calm)
        while self.finished is None:
            if self.clock.now_s > FAULTS_S + PATIENCE_S or not self.clock.step():
                raise BrokenError(f"the run has not ended by {self.clock.now_s:.0f} s")
        self._check_end()

    # -- the learner process ----------------------------------------------------------------

    def _boot(self) -> None:
        """Start a learner process on what the journal holds."""
        self.up, self.life = True, self.life + 1
        book = Book.of(self.journal)
        self.dispatcher = Dispatcher(self.rules, self._token, book)
        self.stopped = False
        self.hear(Begin())
        self._tick(self.life)
        for evaluator in self.evaluators.values():
            self.network.carry(evaluator.name, evaluator.learner_is_new)
            self.clock.after(LEASE_S, evaluator.learner_is_new)

    def _token(self) -> str:
        return f"{self.rng.getrandbits(64):016x}"

    def _tick(self, life: int) -> None:
        if self.up and life == self.life:
            self.hear(Tick())
            self.clock.after(TICK_S, lambda: self._tick(life))

    def hear(self, event: Event) -> None:
        """Handle one event as the owner thread does; it may be killed between any two effects."""
        if not self.up or self.finished is not None:
            return
        self.events += 1
        out = self.dispatcher.handle(event, self.clock.now_s)
        if self.plant.ack_first:
            out.sort(key=lambda instruction: isinstance(instruction, Journal))
        for instruction in out:
            self.crash_in -= 1
            if self.crash_in == 0:
                self._crash()
                return
            self._carry_out(instruction)
        check(self.dispatcher.desk)

    def _crash(self) -> None:
        self.up, self.crash_in = False, 0
        self.clock.after(self.rng.uniform(0.1, 3.0), self._boot)

    def _carry_out(self, instruction: Instruction) -> None:
        match instruction:
            case Journal(entry):
                if type(entry) not in self.plant.forgotten:
                    self.journal.append(entry)
                self._check_entry(entry)
            case Send(name, message):
                if isinstance(message, Ack):
                    self._check_ack(message)
                if isinstance(message, Trial) and self.stopped:
                    raise BrokenError("an attempt was handed out after stop")
                self._deliver(name, message)
            case Broadcast(message):
                for name in self.evaluators:
                    self._deliver(name, message)
            case Ask(episode, trials, _):
                self._ask(episode, trials)
            case EndRun():
                self._ended(instruction)

    def _deliver(self, name: str, message: Message) -> None:
        evaluator = self.evaluators[name]
        self.network.carry(name, lambda: evaluator.receive(message))

    def _ask(self, episode: int, trials: int) -> None:
        told = [tell for batch in self.dispatcher.book.told for tell in batch]
        answer = ProposalsReady(episode, propose(episode, trials, told))
        life = self.life
        delay_s = self.rng.choice((0.0, 0.01, 1.0))
        self.clock.after(delay_s, lambda: self.hear(answer) if life == self.life else None)

    def _ended(self, instruction: EndRun) -> None:
        if self.stopped and instruction.ending is Ending.STOPPED:
            # Stopped, not finished: whoever starts it again finds the run where it was.
            self.up = False
            self.clock.after(self.rng.uniform(0.1, 3.0), self._boot)
            for evaluator in self.evaluators.values():
                self.clock.after(
                    self.rng.uniform(0.1, 3.0), functools.partial(self._revive, evaluator)
                )
        else:
            self.finished = instruction

    def _revive(self, evaluator: SimEvaluator) -> None:
        if not evaluator.alive:
            evaluator.start()

    # -- the adversary ----------------------------------------------------------------------

    def _fault(self) -> None:
        if self.finished is not None or self.clock.now_s >= FAULTS_S:
            return
        evaluator = self.rng.choice(list(self.evaluators.values()))
        back_s = self.rng.uniform(0.1, 6.0)
        self.rng.choice(_FAULTS)(self, evaluator, back_s)
        self.clock.after(self.rng.expovariate(3.0), self._fault)

    def _kill(self, evaluator: SimEvaluator, back_s: float) -> None:
        evaluator.kill()
        self.clock.after(back_s, lambda: self._revive(evaluator))

    def _kill_for_good(self, evaluator: SimEvaluator, _back_s: float) -> None:
        if sum(e.alive for e in self.evaluators.values()) > 1:
            evaluator.kill()

    def _freeze(self, evaluator: SimEvaluator, back_s: float) -> None:
        evaluator.freeze()
        self.clock.after(back_s, evaluator.unfreeze)

    def _hang(self, evaluator: SimEvaluator, _back_s: float) -> None:
        evaluator.hung = True

    def _cut(self, evaluator: SimEvaluator, back_s: float) -> None:
        self.network.cut_off.add(evaluator.name)
        self.clock.after(back_s, lambda: self.network.cut_off.discard(evaluator.name))

    def _kill_learner(self, _evaluator: SimEvaluator, _back_s: float) -> None:
        self.crash_in = self.rng.randrange(1, 9)

    def _operate(self, _evaluator: SimEvaluator, back_s: float) -> None:
        self.hear(OperatorCommand(CommandKind.HOLD))
        self.clock.after(back_s, lambda: self.hear(OperatorCommand(CommandKind.RESUME)))

    def _stop(self, _evaluator: SimEvaluator, _back_s: float) -> None:
        if self.up and self.rng.random() < 0.3:
            self.stopped = True
            self.hear(OperatorCommand(CommandKind.STOP))

    def _forge(self, evaluator: SimEvaluator, _back_s: float) -> None:
        """Let one evaluator report on an attempt that another one has."""
        book = self.dispatcher.book
        tokens = [t for t, a in book.live.items() if a.evaluator != evaluator.name]
        token = self.rng.choice(tokens) if tokens else self._token()
        forged = Result(
            boot=evaluator.boot, token=token, trial=0, kind=OutcomeKind.SUCCESS, cost=-1.0, seed=0
        )
        written = len(self.journal)
        crash_in, self.crash_in = self.crash_in, -1
        self.hear(ResultReceived(evaluator.name, forged))
        self.crash_in = crash_in
        if len(self.journal) != written:
            raise BrokenError("a token that was not issued to the evaluator had an effect")

    def _calm(self) -> None:
        """Stop all faults; at least one evaluator is left alive and well."""
        self.network.faulty = False
        self.network.cut_off.clear()
        for evaluator in self.evaluators.values():
            evaluator.abort_share = 0.0
            if evaluator.frozen:
                evaluator.unfreeze()
        self._supervise()
        self.clock.after(0.0, lambda: self.hear(OperatorCommand(CommandKind.RESUME)))
        self.clock.after(8.0, lambda: self.hear(OperatorCommand(CommandKind.RESUME)))

    def _supervise(self) -> None:
        """See to it that one evaluator lives, as whoever wants the run to end would."""
        if not any(e.alive and not e.hung for e in self.evaluators.values()):
            evaluator = self.rng.choice(list(self.evaluators.values()))
            evaluator.kill()
            evaluator.start()
        self.clock.after(5.0, self._supervise)

    # -- invariants that need more than the desk -------------------------------------------

    def _check_entry(self, entry: Entry) -> None:
        if isinstance(entry, LearnerBooted):
            if entry.epoch in self.epochs:
                raise BrokenError(f"two lives of the learner share epoch {entry.epoch}")
            self.epochs.append(entry.epoch)
        elif isinstance(entry, AttemptIssued):
            if entry.token in self.tokens:
                raise BrokenError("a token was issued twice")
            self.tokens.add(entry.token)

    def _check_ack(self, ack: Ack) -> None:
        """What is acknowledged is in the journal, at this moment and for ever."""
        if ack.verdict is Verdict.UNKNOWN or ack.token in self.acked:
            return
        for entry in reversed(self.journal):
            if isinstance(entry, ResultTaken) and entry.result.token == ack.token:
                self.acked[ack.token] = entry
                return
        raise BrokenError(f"acknowledged as {ack.verdict}, but not in the journal")

    def _check_end(self) -> None:
        assert self.finished is not None
        book = Book.of(self.journal)
        if durable(book) != durable(self.dispatcher.book):
            raise BrokenError("the journal leads to another state than the one it was written from")
        kept = {e.result.token: e for e in self.journal if isinstance(e, ResultTaken)}
        if any(kept.get(token) is not entry for token, entry in self.acked.items()):
            raise BrokenError("an acknowledged result is gone")
        self._check_counts()
        self._check_nothing_wasted(book)
        self._check_order()
        if self.finished.ending is Ending.COMPLETE:
            asked = self.rules.episodes * self.rules.trials
            if book.tally.counted + book.tally.lost != asked or book.unsettled:
                raise BrokenError(f"{book.tally} is not every one of {asked} trials")
            if self.rules.quorum == 1.0 and self.rules.losses_max == self.rules.aborts_max == 100:
                self._check_undisturbed(book)
        elif self.rules.losses_max == self.rules.aborts_max == 100:
            raise BrokenError(f"the run failed: {self.finished.why}")

    def _check_counts(self) -> None:
        counted = [
            e.result.trial
            for e in self.journal
            if isinstance(e, ResultTaken) and e.verdict in {Verdict.COUNTED, Verdict.LATE}
        ]
        if len(counted) != len(set(counted)):
            raise BrokenError("a trial was counted twice")

    def _check_nothing_wasted(self, book: Book) -> None:
        """What was measured reached its trial: trials are dear on robots."""
        measured = {
            book.attempts[e.result.token].trial
            for e in self.journal
            if isinstance(e, ResultTaken) and e.verdict is not Verdict.NOTED
        }
        if any(book.trials[number].result is None for number in measured):
            raise BrokenError("a measured trial has no outcome")

    def _check_order(self) -> None:
        """No result of an episode counts before the one ahead of it has closed."""
        opened = closed = 0
        for entry in self.journal:
            opened += isinstance(entry, TrialsProposed)
            closed += isinstance(entry, EpisodeDone)
            if not closed <= opened <= closed + 1:
                raise BrokenError("an episode opened before the one ahead of it closed")

    def _check_undisturbed(self, book: Book) -> None:
        """A run in which nothing was lost proposed what an undisturbed one would have."""
        told: list[Told] = []
        for episode in range(self.rules.episodes):
            for planned in propose(episode, self.rules.trials, told):
                if book.trials[planned.trial].theta != planned.theta:
                    raise BrokenError(
                        f"trial {planned.trial} is not what an undisturbed run proposes"
                    )
            told += book.told[episode]


_FAULTS = (
    World._kill,
    World._kill,
    World._kill_for_good,
    World._freeze,
    World._freeze,
    World._hang,
    World._cut,
    World._kill_learner,
    World._kill_learner,
    World._operate,
    World._stop,
    World._forge,
)


def durable(book: Book) -> dict[str, object]:
    """Return everything in a book that the journal alone decides."""
    return {name: value for name, value in vars(book).items() if name != "released"}
