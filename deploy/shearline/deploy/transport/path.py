"""The full path, measured at the learner: a real run of a task that does nothing.

Owner, dispatcher, journal, codec and session are the ones of every run; only the outgoing
messages pass a stopwatch.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from shearline.deploy.processes import die_with_parent
from shearline.deploy.transport.child import BenchFailed, Children, report, statistics
from shearline.deploy.transport.task import WaitTask
from shearline.learner.base import Learner
from shearline.learner.dispatcher import Dispatcher
from shearline.learner.dispatcher.events import Event, ResultReceived
from shearline.learner.dispatcher.instructions import Instruction
from shearline.learner.ledger import Trials
from shearline.learner.random_search import RandomSearch
from shearline.learner.run.config import RunConfig
from shearline.learner.run.fitter import Fitter
from shearline.learner.run.folder import Folder, logged_to
from shearline.learner.run.inbox import Inbox
from shearline.learner.run.outgoing import Outgoing
from shearline.learner.run.owner import Owner
from shearline.learner.run.tokens import tokens
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.keys import Keys
from shearline.protocol.link import Link, open_router
from shearline.protocol.messages import Message, Trial, Welcome
from shearline.protocol.switching import quick_switching

#: Trials that each evaluator has done before the clock starts.
WARM = 100

#: Light evaluators of one process.
CROWD = 64

#: Trips between two looks at the processor time, which are dear.
CPU_EVERY = 64

#: How long nothing is to do, and how much of it settles first [s].
IDLE_S = 6.0
SETTLE_S = 1.0


@dataclass(frozen=True, slots=True)
class Trip:
    """One trial, from before its message is encoded until its result is decoded.

    Attributes:
        cpu_s: Processor time of the learner's process so far, as last looked at [s].
        wall_s: How long the trial itself ran, as its evaluator says [s].
    """

    evaluator: str
    sent_s: float
    taken_s: float
    cpu_s: float
    wall_s: float


class Stopwatch:
    """When trials leave and when their results are taken.

    Attributes:
        trips: Round trips, in the order they ended.
        joined_s: When each evaluator was welcomed, by name.
    """

    def __init__(self) -> None:
        self.trips: list[Trip] = []
        self.joined_s: dict[str, float] = {}
        self._sent_s: dict[str, float] = {}
        self._cpu_s = 0.0

    def send(self, evaluator: str, message: Message) -> None:
        """Note a message that is about to be encoded and sent."""
        if isinstance(message, Trial):
            self._sent_s[message.token] = time.perf_counter()
        elif isinstance(message, Welcome):
            self.joined_s.setdefault(evaluator, time.perf_counter())

    def take(self, event: ResultReceived) -> None:
        """Note a result that was decoded and reaches the dispatcher."""
        sent_s = self._sent_s.pop(event.message.token, None)
        if sent_s is not None:
            if len(self.trips) % CPU_EVERY == 0:
                self._cpu_s = time.process_time()
            taken_s, wall_s = time.perf_counter(), event.message.wall_s
            self.trips.append(Trip(event.evaluator, sent_s, taken_s, self._cpu_s, wall_s))


class TimedOutgoing(Outgoing):
    """Outgoing messages that pass a stopwatch."""

    def __init__(self, link: Link, keys: Keys, stopwatch: Stopwatch) -> None:
        super().__init__(link, keys, record=False)
        self._stopwatch = stopwatch

    def send(self, evaluator: str, message: Message, now_s: float) -> None:
        """Send to one evaluator."""
        self._stopwatch.send(evaluator, message)
        super().send(evaluator, message, now_s)


class TimedDispatcher(Dispatcher):
    """A dispatcher whose results pass a stopwatch."""

    def __init__(self, config: RunConfig, stopwatch: Stopwatch) -> None:
        super().__init__(config.rules(), tokens().__next__)
        self._stopwatch = stopwatch

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        """Advance by one event."""
        if isinstance(event, ResultReceived):
            self._stopwatch.take(event)
        return super().handle(event, now_s)


@dataclass(slots=True)
class Bench:
    """One run to be measured.

    Args:
        config: What is run.
        endpoint: Where its evaluators find it.
        run_dir: Its folder, new.
    """

    config: RunConfig
    endpoint: str
    run_dir: Path
    idle_s: float = 0.0
    children: Children = field(default_factory=Children)
    idle: dict[str, float] = field(default_factory=dict)
    stopwatch: Stopwatch = field(default_factory=Stopwatch)

    def lead(self, joining: Callable[[], None]) -> list[Trip]:
        """Lead the run to its end and return its round trips in the order they ended.

        Args:
            joining: Called once evaluators may join.
        """
        keys = Keys(self.run_dir.name)
        with (
            quick_switching(),
            Folder(self.run_dir, self.config) as folder,
            logged_to(self.run_dir / "learner.log"),
            open_router(self.endpoint) as link,
        ):
            intake = link.intake(keys.from_evaluators(), keys.wake())
            inbox = Inbox(intake)
            owner = Owner(
                self.config,
                keys.run,
                TimedDispatcher(self.config, self.stopwatch),
                folder.journal,
                Fitter(self._learner, self.config.seed, inbox),
                TimedOutgoing(link, keys, self.stopwatch),
                inbox,
            )
            epoch = owner.begin()
            link.watch(keys.live_evaluators(), inbox)
            link.announce(keys.live_learner(epoch))
            joining()
            with intake.woken_every(owner.tick_s):
                owner.run()
        return self.stopwatch.trips

    def _learner(self) -> Learner:
        return Pausing(self)


class Pausing(RandomSearch):
    """Random search that takes its time between two episodes, in which everyone is idle."""

    def __init__(self, bench: Bench) -> None:
        config = bench.config
        super().__init__(config.space, config.trials, config.seed)
        self._bench = bench

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        super()._begin(episode, trials, rng)
        if episode == 1:
            self._bench.idle = _idled(self._bench.children, self._bench.idle_s)


def _idled(children: Children, idle_s: float) -> dict[str, float]:
    """Wait, and return the processor shares of learner and children meanwhile, and their memory."""
    time.sleep(SETTLE_S)
    began_s, own_s, theirs_s = time.perf_counter(), time.process_time(), children.cpu_s()
    time.sleep(idle_s)
    took_s = time.perf_counter() - began_s
    return {
        "idle_learner": (time.process_time() - own_s) / took_s,
        "idle_evaluators": (children.cpu_s() - theirs_s) / took_s,
        "memory_bytes": children.memory_bytes(),
    }


def one_by_one(evaluators: int, credits_: int, trials: int, wall_s: float) -> dict[str, float]:
    """Measure with real evaluators, each a process of its own.

    Returns:
        ``p50_s``, ``p99_s``, ``rate_hz``, ``cpu_s`` for each trial at the learner, and
        ``utilisation``: the share of time in which a trial ran, of the mean evaluator.
    """
    config = _config(wall_s, trials, episodes=1)
    with tempfile.TemporaryDirectory() as folder, Children() as children:
        bench = Bench(config, free_endpoint(), Path(folder, "bench"))

        def join() -> None:
            for i in range(evaluators):
                log = Path(folder, f"evaluator-{i}.log")
                children.start("evaluator", bench.endpoint, f"e{i}", credits_, wall_s, log=log)

        trips = steady(bench.lead(join), evaluators, evaluators * credits_)
    took_s = trips[-1].taken_s - trips[0].taken_s
    return statistics([trip.taken_s - trip.sent_s for trip in trips]) | {
        "rate_hz": (len(trips) - 1) / took_s,
        "cpu_s": (trips[-1].cpu_s - trips[0].cpu_s) / (len(trips) - 1),
        "utilisation": sum(trip.wall_s for trip in trips) / took_s / evaluators,
    }


def crowded(evaluators: int, trials: int, idle_s: float = IDLE_S) -> dict[str, float]:
    """Measure with many light evaluators in few processes: two episodes, and idleness between.

    Returns:
        ``join_s`` (from the word to begin to the last welcome), ``rate_hz`` and ``cpu_s`` of the
        second episode, ``memory_bytes`` for each evaluator, ``idle_learner`` and
        ``idle_evaluators`` (shares of a core, all evaluators together).
    """
    config = _config(0.0, trials, episodes=2)
    with tempfile.TemporaryDirectory() as folder, Children() as children:
        bench = Bench(config, free_endpoint(), Path(folder, "bench"), idle_s, children)
        for first in range(0, evaluators, CROWD):
            count = min(CROWD, evaluators - first)
            children.start("evaluator", "crowd", bench.endpoint, "bench", first, count)
        children.hear()
        before_bytes = children.memory_bytes()
        began: list[float] = []

        def join() -> None:
            began.append(time.perf_counter())
            children.say("go")

        trips = bench.lead(join)[trials:]
    joined_s = bench.stopwatch.joined_s
    memory_bytes = bench.idle.pop("memory_bytes") - before_bytes
    return {
        "joined": len(joined_s),
        "join_s": max(joined_s.values()) - began[0],
        "rate_hz": (len(trips) - 1) / (trips[-1].taken_s - trips[0].sent_s),
        "cpu_s": (trips[-1].cpu_s - trips[0].cpu_s) / (len(trips) - 1),
        "memory_bytes": memory_bytes / evaluators,
        **bench.idle,
    }


def _config(wall_s: float, trials: int, episodes: int) -> RunConfig:
    return RunConfig(
        task=WaitTask(wall_s).spec,
        learner="random",
        episodes=episodes,
        trials=trials,
        speculative=False,
        record=False,
    )


def steady(trips: list[Trip], evaluators: int, in_flight: int) -> list[Trip]:
    """Return the round trips after all evaluators are warm and before the run has to end.

    Raises:
        BenchFailed: If not all evaluators became warm.
    """
    done: Counter[str] = Counter()
    warm = 0
    for i, trip in enumerate(trips):
        done[trip.evaluator] += 1
        if done[trip.evaluator] == WARM:
            warm += 1
        if warm == evaluators:
            return trips[i : len(trips) - 4 * in_flight]
    raise BenchFailed(f"expected {evaluators} evaluators to do {WARM} trials each, got {done}")


if __name__ == "__main__":
    die_with_parent()
    if sys.argv[1] == "crowd":
        report(crowded(int(sys.argv[2]), int(sys.argv[3])))
    else:
        count, at_once, trials_ = map(int, sys.argv[1:4])
        report(one_by_one(count, at_once, trials_, float(sys.argv[4])))
    os._exit(0)
