"""The adversary: everything that can go wrong, at random times, until it must stop."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from simulation.evaluators import LEASE_S, SimEvaluator
from simulation.promises import BrokenError

from shearline.learner.dispatcher.events import (
    CreditReceived,
    HelloReceived,
    OperatorCommand,
    RenewReceived,
    ResultReceived,
)
from shearline.protocol.messages import CommandKind, Credit, OutcomeKind, Renew, Result

if TYPE_CHECKING:
    from simulation.world import World

#: Faults for each second of virtual time, on average.
FAULTS_HZ = 3.0

#: How far the learner's clock is set forward or back [s].
JUMPS_S = (0.5, 5.0, 3600.0, -0.5, -7200.0)


class Adversary:
    """Breaks things in one world.

    Args:
        world: Whose rng decides what, when and whom.
        until_s: When it must stop [s].
    """

    def __init__(self, world: World, until_s: float) -> None:
        self.world = world
        self.rng = world.rng
        self.until_s = until_s
        self._liars: set[str] = set()
        world.clock.after(self.rng.expovariate(FAULTS_HZ), self._strike)
        world.clock.after(until_s, self._calm)

    def _strike(self) -> None:
        world = self.world
        if world.finished is not None or world.clock.now_s >= self.until_s:
            return
        evaluator = self.rng.choice(list(world.evaluators.values()))
        self.rng.choice(_FAULTS)(self, evaluator, self.rng.uniform(0.1, 6.0))
        world.clock.after(self.rng.expovariate(FAULTS_HZ), self._strike)

    # -- evaluators -------------------------------------------------------------------------

    def _kill(self, evaluator: SimEvaluator, back_s: float) -> None:
        evaluator.kill()
        self.world.clock.after(back_s, lambda: revive(evaluator))

    def _kill_for_good(self, evaluator: SimEvaluator, _back_s: float) -> None:
        """One must live that may run whatever the run still wants."""
        wanted = self.world.rules.confirm_on
        others = [e for e in self.world.evaluators.values() if e is not evaluator and e.alive]
        if any(wanted in {"", e.kind} for e in others):
            evaluator.kill()

    def _freeze(self, evaluator: SimEvaluator, back_s: float) -> None:
        evaluator.freeze()
        self.world.clock.after(back_s, evaluator.unfreeze)

    def _hang(self, evaluator: SimEvaluator, _back_s: float) -> None:
        evaluator.hung = True

    def _slow(self, evaluator: SimEvaluator, back_s: float) -> None:
        evaluator.drag = 20.0
        self.world.clock.after(back_s, evaluator.hasten)

    # -- the network ------------------------------------------------------------------------

    def _cut(self, evaluator: SimEvaluator, back_s: float) -> None:
        """Cut one evaluator off: both ways, or so that it is only not heard, or does not hear."""
        network, name = self.world.network, evaluator.name
        for way in self.rng.choice(
            ((network.mute, network.deaf), (network.mute,), (network.deaf,))
        ):
            way.add(name)
            self.world.clock.after(back_s, lambda way=way: way.discard(name))  # type: ignore[misc]

    def _cut_all(self, _evaluator: SimEvaluator, back_s: float) -> None:
        for evaluator in self.world.evaluators.values():
            self._cut(evaluator, back_s)

    # -- the learner ------------------------------------------------------------------------

    def _kill_learner(self, _evaluator: SimEvaluator, _back_s: float) -> None:
        self.world.crash_in = self.rng.randrange(1, 9)

    def _freeze_learner(self, _evaluator: SimEvaluator, back_s: float) -> None:
        self.world.freeze()
        self.world.clock.after(back_s, self.world.unfreeze)

    def _set_clock(self, _evaluator: SimEvaluator, _back_s: float) -> None:
        self.world.set_clock(self.rng.choice(JUMPS_S))

    # -- the operator -----------------------------------------------------------------------

    def _operate(self, _evaluator: SimEvaluator, back_s: float) -> None:
        self.world.hear(OperatorCommand(CommandKind.HOLD))
        resume = OperatorCommand(CommandKind.RESUME)
        self.world.clock.after(back_s, lambda: self.world.hear(resume))

    def _stop(self, _evaluator: SimEvaluator, _back_s: float) -> None:
        if self.rng.random() < 0.3:
            self.world.stop()

    # -- lies -------------------------------------------------------------------------------

    def _forge(self, evaluator: SimEvaluator, _back_s: float) -> None:
        """Report on an attempt that another evaluator has: nothing may come of it."""
        world = self.world
        attempts = world.dispatcher.book.attempts.values()
        tokens = [a.token for a in attempts if a.evaluator != evaluator.name]
        token = self.rng.choice(tokens) if tokens else world.token()
        written = len(world.promises.journal)
        crash_in, world.crash_in = world.crash_in, -1
        world.hear(ResultReceived(evaluator.name, self._false_result(evaluator, token)))
        world.crash_in = crash_in
        if len(world.promises.journal) != written:
            raise BrokenError("a token that was not issued to the evaluator had an effect")

    def _lie(self, evaluator: SimEvaluator, _back_s: float) -> None:
        """Change one's word about attempts of one's own, and renew what others hold."""
        world, name = self.world, evaluator.name
        attempts = world.dispatcher.book.attempts
        own = [token for token, attempt in attempts.items() if attempt.evaluator == name]
        for token in self.rng.sample(own, min(3, len(own))):
            world.hear(ResultReceived(name, self._false_result(evaluator, token)))
        world.hear(RenewReceived(name, Renew(boot=evaluator.boot, tokens=list(attempts))))

    def _boast(self, evaluator: SimEvaluator, _back_s: float) -> None:
        """Claim room that one does not have, for ever."""
        self._liars.add(evaluator.name)
        credit = Credit(boot=evaluator.boot, seq=2**60, credits=1024)
        self.world.hear(CreditReceived(evaluator.name, credit))

    def _pose(self, evaluator: SimEvaluator, _back_s: float) -> None:
        """Say hello and credit as a second process of the same name."""
        ghost = f"ghost-of-{evaluator.name}-{self.rng.randrange(2)}"
        self.world.hear(HelloReceived(evaluator.name, evaluator.hello(ghost)))
        credit = Credit(boot=ghost, seq=self.rng.randrange(9), credits=2)
        self.world.hear(CreditReceived(evaluator.name, credit))

    def _false_result(self, evaluator: SimEvaluator, token: str) -> Result:
        attempt = self.world.dispatcher.book.attempts.get(token)
        return Result(
            boot=evaluator.boot,
            token=token,
            trial=attempt.trial if attempt else 0,
            kind=self.rng.choice((OutcomeKind.SUCCESS, OutcomeKind.FAILURE)),
            cost=-1.0,
            seed=0,
        )

    # -- the end of faults ------------------------------------------------------------------

    def _calm(self) -> None:
        """Stop all faults; at least one evaluator is left alive and well."""
        world = self.world
        world.network.calm()
        world.unfreeze()
        for evaluator in world.evaluators.values():
            evaluator.abort_share = 0.0
            evaluator.hasten()
            if evaluator.frozen:
                evaluator.unfreeze()
            if evaluator.name in self._liars:
                evaluator.kill()
                evaluator.start()
        self._supervise()
        resume = OperatorCommand(CommandKind.RESUME)
        for wait_s in (0.0, 4 * LEASE_S):
            world.clock.after(wait_s, lambda: world.hear(resume))

    def _supervise(self) -> None:
        """See to it that one evaluator lives that may run what is left, as its owner would."""
        wanted = self.world.rules.confirm_on
        able = [e for e in self.world.evaluators.values() if wanted in {"", e.kind}]
        if not any(e.alive and not e.hung for e in able):
            evaluator = self.rng.choice(able)
            evaluator.kill()
            evaluator.start()
        self.world.clock.after(5.0, self._supervise)


def revive(evaluator: SimEvaluator) -> None:
    """Start a process in place of a dead one."""
    if not evaluator.alive:
        evaluator.start()


_Fault = Callable[[Adversary, SimEvaluator, float], None]

#: One of these strikes at a time; what stands twice strikes twice as often.
_FAULTS: tuple[_Fault, ...] = (
    Adversary._kill,
    Adversary._kill,
    Adversary._kill_for_good,
    Adversary._freeze,
    Adversary._freeze,
    Adversary._hang,
    Adversary._slow,
    Adversary._cut,
    Adversary._cut,
    Adversary._cut_all,
    Adversary._kill_learner,
    Adversary._kill_learner,
    Adversary._freeze_learner,
    Adversary._set_clock,
    Adversary._operate,
    Adversary._stop,
    Adversary._forge,
    Adversary._lie,
    Adversary._boast,
    Adversary._pose,
)
