"""Everything at once, on a schedule drawn from a seed: kills, stops, bad lines and echoes."""

from __future__ import annotations

import random
import signal
import subprocess
from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime

from chaos.fleet import PATIENCE_S, Fleet
from chaos.invariants import Audit, expect_kept
from chaos.relay import Relay

from shearline.deploy.processes import Child
from shearline.learner.dispatcher.entries import AnyEntry

#: What befalls a line for one round, and what ends it.
WEATHERS = (("freeze", "thaw"), ("hush down", "thaw"), ("reset", "mend"), ("cut", "mend"),
            ("delay 0.1", "delay 0"))  # fmt: skip


@dataclass
class Mayhem:
    """Hurts one fleet until its run ends.

    Args:
        fleet: Whose.
        names: Evaluators; every second one stands behind a relay.
        kill_learner_at: Counted trials at which the learner is killed and started again.
        every_s: Time between two kills of evaluators [s].
        learner_arguments: For its later lives.

    Attributes:
        done: How often each kind of harm was done.
    """

    fleet: Fleet
    names: tuple[str, ...]
    kill_learner_at: tuple[int, ...] = ()
    every_s: float = 0.5
    learner_arguments: tuple[str, ...] = ()
    done: Counter[str] = field(default_factory=Counter)
    _evaluators: dict[str, Child] = field(default_factory=dict)
    _relays: dict[str, Relay] = field(default_factory=dict)
    _to_calm: list[tuple[str, str]] = field(default_factory=list)
    _before: list[AnyEntry] = field(default_factory=list)

    def run(self) -> list[AnyEntry]:
        """Lead the run through it; return the journal, which kept what it had at every look."""
        dice = random.Random(0)
        learner = self.fleet.learner(*self.learner_arguments)
        for name in self.names[1::2]:
            self._relays[name] = self.fleet.relay(f"relay-{name}")
        for name in self.names:
            self._start(name)
        self.fleet.script("repeater", "repeater.py", self.fleet.run_dir.name, "0.3", "3")
        kills = list(self.kill_learner_at)
        rounds = round(PATIENCE_S / self.every_s)
        while not self._has_ended(learner) and self.done["round"] < rounds:
            self._look()
            if kills and len(Audit(self._before).counted) >= kills[0]:
                del kills[0]
                self._note("kill learner")
                learner.process.kill()
                learner.process.wait()
                self._look()
                learner = self.fleet.learner("--resume", *self.learner_arguments)
                self.done["learner killed"] += 1
            self._round(dice)
        self._calm()
        self.fleet.outcome(learner)
        self._look()
        assert not kills, f"the run ended before the learner was killed at {kills}"
        return self._before

    def _has_ended(self, learner: Child) -> bool:
        try:
            learner.process.wait(self.every_s)
        except subprocess.TimeoutExpired:
            return False
        return True

    def _look(self) -> None:
        """Assert that what the journal held at the last look still stands there."""
        now = self.fleet.entries()
        expect_kept(self._before, now)
        self._before = now

    def _round(self, dice: random.Random) -> None:
        """Kill one evaluator, now and then stop another or spoil its line, end older harm."""
        self.done["round"] += 1
        self._calm()
        victim, second = dice.sample(self.names, 2)
        self._note(f"kill {victim}")
        self._evaluators[victim].process.kill()
        self._evaluators[victim].process.wait()
        self._start(victim)
        self.done["killed"] += 1
        if self.done["round"] % 2:
            return
        relay = self._relays.get(second)
        if relay is None:
            self._note(f"stop {second}")
            self._evaluators[second].process.send_signal(signal.SIGSTOP)
            self._to_calm.append((second, ""))
            self.done["stopped"] += 1
        else:
            harm, cure = dice.choice(WEATHERS)
            self._note(f"{harm} {second}")
            relay.order(harm)
            self._to_calm.append((second, cure))
            self.done[harm] += 1

    def _calm(self) -> None:
        for name, cure in self._to_calm:
            self._note(f"{cure or 'continue'} {name}")
            if cure:
                self._relays[name].order(cure)
            elif self._evaluators[name].returncode is None:
                self._evaluators[name].process.send_signal(signal.SIGCONT)
        self._to_calm.clear()

    def _note(self, what: str) -> None:
        """Keep what was done, and when, beside what the children write."""
        moment = datetime.now(UTC).strftime("%H:%M:%S.%f")
        with (self.fleet.folder / "mayhem.log").open("a") as log:
            log.write(f"{moment} {what}\n")

    def _start(self, name: str) -> None:
        relay = self._relays.get(name)
        through = relay.endpoint if relay is not None else ""
        self._evaluators[name] = self.fleet.evaluator(name, through=through)
