"""A whole run in virtual time: learner process, journal, network, evaluators, and an adversary.

Everything is decided by one seed. After every event the invariants of the protocol are asserted;
when the faults stop, the run must end.
"""

from __future__ import annotations

import functools
import random
from dataclasses import replace

from simulation.adversary import Adversary, revive
from simulation.evaluators import LEASE_S, SimEvaluator
from simulation.network import Clock, Network
from simulation.plants import NONE, Plant
from simulation.promises import BrokenError, Promises, learn_from_no_confirmation, propose

from shearline.learner.dispatcher import Book, Dispatcher, Rules
from shearline.learner.dispatcher.checks import check, check_desk
from shearline.learner.dispatcher.events import (
    Begin,
    Event,
    OperatorCommand,
    ProposalsReady,
    RenewReceived,
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
)
from shearline.protocol.messages import Ack, CommandKind, Message, Trial
from shearline.protocol.task import TaskSpec

FAULTS_S = 12.0
#: Far beyond what any run needs once faults stop: a minute of rest, and sixty trials of half a
#: minute on one slow evaluator (seed 48663 of an earlier version took 420 s).
PATIENCE_S = 2000.0
TICK_S = LEASE_S / 8
TASK = TaskSpec(name="sim", space={"x": ("", 0.0, 1.0)}, trial_s=8.0)


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
        rules = self._rules(seed)
        self.finished: EndRun | None = None
        self.up = self.frozen = self.stopped = False
        self.life = 0
        self.crash_in = 0
        self.skew_s = 0.0
        self._backlog: list[tuple[int, Event]] = []
        kinds = ("simulator", "function", "robot")
        self.evaluators = {
            name: SimEvaluator(name, self.rng.choice(kinds), self.clock, self.network, self.rng)
            for name in ("a", "b", "c", "d")[: self.rng.choice((1, 2, 3, 4))]
        }
        for evaluator in self.evaluators.values():
            evaluator.learner = self
        confirm_on = random.Random(f"confirm on {seed}").choice(
            ("", "", *(e.kind for e in self.evaluators.values()))
        )
        self.rules = replace(rules, confirm_on=confirm_on)
        self.promises = Promises(self.rules)

    def _rules(self, seed: int) -> Rules:
        # From a generator of its own: what a seed meant before there were confirmations, it means.
        confirm = random.Random(f"confirm {seed}")
        return Rules(
            task=TASK,
            episodes=self.rng.choice((1, 2, 3)),
            trials=self.rng.choice((2, 8, 20)),
            lease_s=LEASE_S,
            speculative=self.rng.random() < 0.7,
            quorum=self.rng.choice((1.0, 1.0, 0.5)),
            quorum_after_s=5.0,
            losses_max=self.rng.choice((3, 100)),
            aborts_max=self.rng.choice((3, 100)),
            confirm=confirm.choice((0, 0, 3)),
            confirm_region=confirm.choice((0, 0, 0, 2)),
        )

    def run(self) -> None:
        """Let everything happen until the run ends.

        Raises:
            BrokenError: If it does not, or a promise is broken on the way.
        """
        self._boot()
        Adversary(self, FAULTS_S)
        while self.finished is None:
            if self.clock.now_s > FAULTS_S + PATIENCE_S or not self.clock.step():
                raise BrokenError(f"the run has not ended by {self.clock.now_s:.0f} s")
        check(self.dispatcher.desk)
        self.promises.kept(self.dispatcher.book, self.finished)

    # -- what the adversary may do to the learner -------------------------------------------

    def freeze(self) -> None:
        """Stop the learner process as SIGSTOP does; what arrives waits in its queue."""
        self.frozen = True

    def unfreeze(self) -> None:
        """Let it go on where it stopped."""
        self.frozen = False
        waiting, self._backlog = self._backlog, []
        for life, event in waiting:
            if life == self.life:
                self.hear(event)

    def set_clock(self, by_s: float) -> None:
        """Set the learner's clock."""
        self.skew_s += by_s
        self.promises.jumps += 1

    def stop(self) -> None:
        """Have the operator stop the run; somebody starts it again later."""
        if self.up and not self.frozen:
            self.stopped = True
            self.hear(OperatorCommand(CommandKind.STOP))

    def token(self) -> str:
        """Return a new token."""
        return f"{self.rng.getrandbits(64):016x}"

    # -- the learner process ----------------------------------------------------------------

    def _boot(self) -> None:
        """Start a learner process on what the journal holds."""
        self.up, self.life, self.frozen = True, self.life + 1, False
        self.dispatcher = Dispatcher(self.rules, self.token, Book.of(self.promises.journal))
        self.stopped = False
        for token in self.dispatcher.book.live:
            self.promises.renewed([token], self.clock.now_s)
        self.hear(Begin())
        self._tick(self.life)
        for evaluator in self.evaluators.values():
            self.network.carry(evaluator.name, evaluator.learner_is_new, up=False)
            self.clock.after(LEASE_S, evaluator.learner_is_new)

    def _tick(self, life: int) -> None:
        if self.up and life == self.life:
            if not self.frozen:
                self.hear(Tick())
            self.clock.after(TICK_S, lambda: self._tick(life))

    def hear(self, event: Event) -> None:
        """Handle one event as the owner thread does; it may be killed between any two effects."""
        if not self.up or self.finished is not None:
            return
        if self.frozen:
            self._backlog.append((self.life, event))
            return
        out = self.dispatcher.handle(event, self.clock.now_s + self.skew_s)
        if isinstance(event, RenewReceived):
            self._note_renewal(event)
        if self.plant.ack_first:
            out.sort(key=lambda instruction: isinstance(instruction, Journal))
        learn_from_no_confirmation(out, self.rules.episodes * self.rules.trials)
        for instruction in out:
            self.crash_in -= 1
            if self.crash_in == 0:
                self._crash()
                return
            self._carry_out(instruction)
        # The book changes by entries only: without one, what it promised still holds.
        if any(isinstance(instruction, Journal) for instruction in out):
            check(self.dispatcher.desk)
        else:
            check_desk(self.dispatcher.desk)

    def _note_renewal(self, event: RenewReceived) -> None:
        attempts = self.dispatcher.book.attempts
        own = [
            t
            for t in event.message.tokens
            if t in attempts
            and (attempts[t].evaluator, attempts[t].boot) == (event.evaluator, event.message.boot)
        ]
        self.promises.renewed(own, self.clock.now_s)

    def _crash(self) -> None:
        self.up, self.crash_in = False, 0
        self.clock.after(self.rng.uniform(0.1, 3.0), self._boot)

    def _carry_out(self, instruction: Instruction) -> None:
        match instruction:
            case Journal(entry):
                if type(entry) not in self.plant.forgotten:
                    self.promises.journal.append(entry)
                self.promises.decided(entry, self.clock.now_s)
            case Send(name, message):
                if isinstance(message, Ack):
                    self.promises.acknowledged(message)
                if isinstance(message, Trial) and self.stopped:
                    raise BrokenError("an attempt was handed out after stop")
                self._deliver(name, message)
            case Broadcast(message):
                for name in self.evaluators:
                    self._deliver(name, message)
            case Ask():
                self._ask(instruction)
            case EndRun():
                self._ended(instruction)

    def _deliver(self, name: str, message: Message) -> None:
        evaluator = self.evaluators[name]
        self.network.carry(name, lambda: evaluator.receive(message), up=False)

    def _ask(self, ask: Ask) -> None:
        # What is to be confirmed is what was recommended when the last episode had closed.
        batches = self.dispatcher.book.told[: self.rules.episodes]
        told = [tell for batch in batches for tell in batch]
        answer = ProposalsReady(ask.episode, propose(ask.episode, ask.trials, told, ask.first))
        life = self.life
        delay_s = self.rng.choice((0.0, 0.01, 1.0))
        self.clock.after(delay_s, lambda: self.hear(answer) if life == self.life else None)

    def _ended(self, instruction: EndRun) -> None:
        if not (self.stopped and instruction.ending is Ending.STOPPED):
            self.finished = instruction
            return
        # Stopped, not finished: whoever starts it again finds the run where it was.
        self.up = False
        self.clock.after(self.rng.uniform(0.1, 3.0), self._boot)
        for evaluator in self.evaluators.values():
            back_s = self.rng.uniform(0.1, 3.0)
            self.clock.after(back_s, functools.partial(revive, evaluator))
