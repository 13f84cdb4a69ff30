"""A learner in the test's own process that can hand out trials, and a worker beside it."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any, Self, TypeVar

from shearline.evaluator.base import Task
from shearline.evaluator.builtin import BowlTask
from shearline.evaluator.postman import End
from shearline.evaluator.worker import Worker, WorkerConfig
from shearline.protocol.codec import BY_TOPIC, decode, encode
from shearline.protocol.intake import Presence
from shearline.protocol.keys import Keys, parse
from shearline.protocol.link import Link, open_router
from shearline.protocol.messages import (
    Ack,
    Command,
    CommandKind,
    Credit,
    Hello,
    Message,
    Result,
    Trial,
    Verdict,
    Welcome,
)
from shearline.protocol.task import TaskSpec

M = TypeVar("M", bound=Message)
WAIT_S = 5.0
NAME = "lab-1"
BOWL = BowlTask(1)


@dataclass
class TinyLearner:
    """Just enough of a learner to test a worker: it says what the test tells it to say."""

    endpoint: str
    epoch: int = 1
    run: str = "run-1"
    spec: TaskSpec = BOWL.spec
    lease_s: float = 1.0
    heard: list[Message] = field(default_factory=list)

    def __enter__(self) -> Self:
        self.inbox: SimpleQueue[Any] = SimpleQueue()
        self.link: Link = open_router(self.endpoint)
        self.keys = Keys(self.run)
        self.traces: SimpleQueue[Any] = SimpleQueue()
        self.link.subscribe(self.keys.from_evaluators(), self.inbox)
        self.link.subscribe(self.keys.observed(), self.traces)
        self.link.watch(self.keys.live_evaluators(), self.inbox)
        self.link.announce(self.keys.live_learner(self.epoch))
        return self

    def __exit__(self, *_: object) -> None:
        self.link.close()

    def say(self, message: Message) -> None:
        self.link.publish(self.keys.down(NAME, message), encode(message))

    def next(self, kind: type[M], where: Callable[[M], bool] = lambda _: True) -> M:
        """Return the next message of a kind, past whatever comes before it."""
        end_s = time.monotonic() + WAIT_S
        while True:
            item = self.inbox.get(timeout=max(0.01, end_s - time.monotonic()))
            if isinstance(item, Presence):
                continue
            message = decode(item.payload, *BY_TOPIC[parse(item.key).topic])
            self.heard.append(message)
            if isinstance(message, kind) and where(message):
                return message

    def presence(self, *, alive: bool) -> str:
        """Return the boot of the next evaluator that appears or vanishes."""
        while True:
            item = self.inbox.get(timeout=WAIT_S)
            if isinstance(item, Presence) and item.alive is alive:
                return parse(item.key).life

    def welcome(self) -> Hello:
        hello = self.next(Hello)
        self.say(Welcome(boot=hello.boot, epoch=self.epoch, task=self.spec, lease_s=self.lease_s))
        return hello

    def ready(self) -> Hello:
        """Welcome a worker and wait until it has room."""
        hello = self.welcome()
        self.next(Credit, lambda credit: credit.credits > 0)
        return hello

    def give(self, hello: Hello, number: int, theta: list[float], **changes: Any) -> Trial:
        facts: dict[str, Any] = {
            "boot": hello.boot,
            "epoch": self.epoch,
            "trial": number,
            "episode": 0,
            "attempt": 1,
            "token": f"token-{number:06}",
            "theta": theta,
            "seed": number,
            "lease_s": self.lease_s,
            "deadline_s": 10.0,
        }
        trial = Trial(**(facts | changes))
        self.say(trial)
        return trial

    def take(self, verdict: Verdict = Verdict.COUNTED) -> Result:
        result = self.next(Result)
        self.say(Ack(boot=result.boot, token=result.token, verdict=verdict))
        return result

    def stop(self) -> None:
        stop = Command(kind=CommandKind.STOP, why="the run is complete")
        self.link.publish(self.keys.all_cmd(), encode(stop))


@dataclass
class Running:
    """A worker on a thread of this process."""

    ends: SimpleQueue[End] = field(default_factory=SimpleQueue)
    exits: SimpleQueue[int] = field(default_factory=SimpleQueue)

    def end(self) -> End:
        return self.ends.get(timeout=WAIT_S)


@contextmanager
def working(endpoint: str, task: Task | None = BOWL, **changes: Any) -> Iterator[Running]:
    config = WorkerConfig(connect=endpoint, name=NAME, **changes)
    running = Running()
    worker = Worker(config, task, running.exits.put)
    thread = threading.Thread(target=lambda: running.ends.put(worker.run()), daemon=True)
    thread.start()
    try:
        yield running
    except BaseException:
        worker.exchange.leave(130, "the test failed")
        raise
    finally:
        thread.join(WAIT_S)
