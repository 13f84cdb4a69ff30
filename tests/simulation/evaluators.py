"""Simulated evaluators: the evaluator's side of the protocol, in virtual time.

One of them says hello until welcomed, announces credits as a heartbeat, runs one trial at a time
from a bounded queue, renews what it holds from the trial's own loop, and sends a result again
until it is acknowledged. It can be killed, frozen, hung, or lie.
"""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Callable
from typing import Protocol

from simulation.network import Clock, Network

from shearline.learner.dispatcher.events import (
    ByeReceived,
    CreditReceived,
    EvaluatorGone,
    Event,
    HelloReceived,
    RenewReceived,
    ResultReceived,
)
from shearline.protocol.messages import (
    VERSION,
    Ack,
    Bye,
    Command,
    CommandKind,
    Credit,
    Hello,
    Message,
    OutcomeKind,
    Refused,
    Renew,
    Result,
    Trial,
    Welcome,
)

LEASE_S = 2.0
BEAT_S = LEASE_S / 2
RENEW_S = LEASE_S / 4
RESEND_S = LEASE_S / 4
SILENCE_S = 10 * LEASE_S

#: A stubborn evaluator's longest trial; whoever supervises evaluators kills it by then.
FOREVER_S = 60.0


class Learner(Protocol):
    """Where events go."""

    def hear(self, event: Event) -> None:
        """Take one event, or lose it while down."""
        ...


def verdict_of(trial: Trial) -> tuple[OutcomeKind, float]:
    """Return the one outcome that a trial has, wherever and however often it runs."""
    cost = abs(hash((round(trial.theta[0], 12), trial.seed))) % 1000 / 1000.0
    return (OutcomeKind.SUCCESS if cost < 0.5 else OutcomeKind.FAILURE), cost


class SimEvaluator:
    """One evaluator by name, over all its boots."""

    def __init__(
        self, name: str, kind: str, clock: Clock, network: Network, rng: random.Random
    ) -> None:
        self.name = name
        self.kind = kind
        self.clock = clock
        self.network = network
        self.rng = rng
        self.learner: Learner | None = None
        self.credits = 1 if kind == "robot" else rng.choice((1, 2, 3))
        self.pace_s = math.pow(10.0, rng.uniform(-2, 0.6))
        self.abort_share = rng.choice((0.0, 0.0, 0.1))
        self.drag = 1.0
        self.stubborn = rng.random() < 0.3
        self.alive = False
        self.frozen = False
        self.hung = False
        self.thaw: list[Callable[[], None]] = []
        self.boot = ""
        self.boots = 0
        self.start()

    # -- life -------------------------------------------------------------------------------

    def start(self) -> None:
        """Start a new process."""
        self.boots += 1
        self.boot = f"{self.name}-boot-{self.boots}"
        self.alive, self.frozen, self.hung = True, False, False
        self.welcomed = self.held = self.leaving = False
        self.epoch = self.seq = 0
        self.heard_s = self.clock.now_s
        self.queue: deque[Trial] = deque()
        self.running: Trial | None = None
        self.results: dict[str, Result] = {}
        self.seen: set[str] = set()
        boot = self.boot
        self.clock.after(self.rng.random(), lambda: self._beat(boot))

    def kill(self) -> None:
        """End the process at once; the network notices soon, late or, rarely, never."""
        if not self.alive:
            return
        self.alive = False
        notice_s = self.rng.choice((0.003, 0.09, LEASE_S, None))
        if notice_s is not None:
            event = EvaluatorGone(self.name, self.boot)
            self.clock.after(notice_s, lambda: self._hear(event))

    def freeze(self) -> None:
        """Stop the process as SIGSTOP does."""
        self.frozen = True
        if self.rng.random() < 0.5:
            event = EvaluatorGone(self.name, self.boot)
            self.clock.after(LEASE_S, lambda: self._hear(event) if self.frozen else None)

    def unfreeze(self) -> None:
        """Let it go on where it stopped."""
        self.frozen = False
        waiting, self.thaw = self.thaw, []
        for act in waiting:
            act()

    def hasten(self) -> None:
        """Run trials at its own pace again."""
        self.drag = 1.0

    def _awake(self, boot: str, act: Callable[[], None]) -> bool:
        """Tell whether this boot may act now; if it is frozen, have it act at the thaw."""
        if not self.alive or boot != self.boot:
            return False
        if self.frozen:
            self.thaw.append(act)
        return not self.frozen

    # -- its own rhythm ---------------------------------------------------------------------

    def _beat(self, boot: str) -> None:
        if not self._awake(boot, lambda: self._beat(boot)):
            return
        if self.welcomed:
            self.seq += 1
            self._say(
                CreditReceived(self.name, Credit(boot=boot, seq=self.seq, credits=self.credits))
            )
        if not self.welcomed or self.clock.now_s - self.heard_s > SILENCE_S:
            self._say(HelloReceived(self.name, self.hello(boot)))
        self.clock.after(BEAT_S if self.welcomed else RESEND_S, lambda: self._beat(boot))

    def hello(self, boot: str) -> Hello:
        """Return how a process of this name introduces itself."""
        return Hello(
            boot=boot,
            version=VERSION,
            task_digest="",
            kind=self.kind,
            engine="sim",
            credits=self.credits,
        )

    def _work(self) -> None:
        if self.running is not None or self.held or not self.queue:
            return
        trial = self.running = self.queue.popleft()
        boot = self.boot
        wall_s = self.drag * self.pace_s * self.rng.uniform(0.5, 1.5)
        wall_s *= 10.0 if self.rng.random() < 0.05 else 1.0
        # Most notice that a trial takes too long; some go on with it for ever, or nearly so.
        limit_s = FOREVER_S if self.stubborn else trial.deadline_s + 1.0
        in_time = wall_s < limit_s
        self.clock.after(min(wall_s, limit_s), lambda: self._done(boot, trial, in_time))
        self._renew(boot, trial)

    def _renew(self, boot: str, trial: Trial) -> None:
        if not self._awake(boot, lambda: self._renew(boot, trial)):
            return
        if self.running is not trial or self.hung:
            return
        tokens = [trial.token, *(waiting.token for waiting in self.queue)]
        self._say(RenewReceived(self.name, Renew(boot=boot, tokens=tokens)))
        self.clock.after(RENEW_S, lambda: self._renew(boot, trial))

    def _done(self, boot: str, trial: Trial, in_time: bool) -> None:  # noqa: FBT001 - a fact
        if not self._awake(boot, lambda: self._done(boot, trial, in_time)):
            return
        if self.hung:
            self.clock.after(1.0, lambda: self._done(boot, trial, in_time))
            return
        self.running = None
        kind, cost = verdict_of(trial)
        if not in_time or self.rng.random() < self.abort_share:
            kind, cost = OutcomeKind.ABORTED, 0.0
        self.results[trial.token] = Result(
            boot=boot, token=trial.token, trial=trial.trial, kind=kind, cost=cost, seed=trial.seed
        )
        self._resend(boot, trial.token)
        self._work()

    def _resend(self, boot: str, token: str) -> None:
        if not self._awake(boot, lambda: self._resend(boot, token)):
            return
        if token in self.results:
            self._say(ResultReceived(self.name, self.results[token]))
            self.clock.after(RESEND_S, lambda: self._resend(boot, token))

    # -- what it hears ----------------------------------------------------------------------

    def receive(self, message: Message) -> None:
        """Take one message from the learner."""
        boot = self.boot
        if not self._awake(boot, lambda: self.receive(message)):
            return
        if getattr(message, "boot", boot) != boot:
            return
        self.heard_s = self.clock.now_s
        match message:
            case Welcome():
                self.welcomed, self.held = True, message.held
                self.epoch = max(self.epoch, message.epoch)
            case Trial():
                self._take(message)
            case Ack():
                self.results.pop(message.token, None)
                self._leave()
            case Command():
                self._obey(message)
            case Refused():
                self.alive = False
        self._work()

    def _take(self, trial: Trial) -> None:
        room = len(self.queue) + (self.running is not None) < self.credits
        if trial.token in self.seen or trial.epoch < self.epoch or not room:
            return
        self.seen.add(trial.token)
        self.queue.append(trial)

    def _obey(self, command: Command) -> None:
        if command.kind is CommandKind.STOP:
            self.leaving = self.held = True
            self.queue.clear()
            self._leave()
        else:
            self.held = command.kind is CommandKind.HOLD

    def _leave(self) -> None:
        """Leave once nothing runs and everything is delivered."""
        if self.leaving and self.alive and self.running is None and not self.results:
            self._say(ByeReceived(self.name, Bye(boot=self.boot, why="told to")))
            self.alive = False

    def learner_is_new(self) -> None:
        """Liveliness shows another epoch of the learner: introduce oneself again."""
        self.welcomed = False

    def _say(self, event: Event) -> None:
        self.network.carry(self.name, lambda: self._hear(event), up=True)

    def _hear(self, event: Event) -> None:
        assert self.learner is not None
        self.learner.hear(event)
