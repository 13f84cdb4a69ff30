"""The evaluators of the transport benchmark: one real one, or many light ones in one process.

The real one is what ``shearline evaluator`` is: worker, postman, log lines. A light one is a
mailbox and a client session of its own; all of one process share the thread that serves them.
"""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import time
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from shearline.deploy.processes import die_with_parent
from shearline.deploy.transport.task import WaitTask
from shearline.evaluator.local import run_trial
from shearline.evaluator.mail import Ended, Event, Heard, LearnerAlive, Quit, Run, Send, Tick
from shearline.evaluator.mailbox import Mailbox
from shearline.evaluator.worker import WorkerConfig, run_worker
from shearline.protocol.codec import BY_TOPIC, decode, encode
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.intake import Arrival
from shearline.protocol.keys import Keys, parse
from shearline.protocol.link import LIGHT, Link, open_client, open_router
from shearline.protocol.messages import VERSION, Hello, Result, Trial
from shearline.protocol.task import digest

#: How often the timers of light evaluators are looked at [s]; they are set in quarters of seconds.
LOOK_S = 0.1


def work(endpoint: str, name: str, credits_: int, wall_s: float) -> int:
    """Be one evaluator until the run ends; return its exit code."""
    logging.basicConfig(format="%(asctime)s %(message)s", level=logging.INFO, stream=sys.stderr)
    config = WorkerConfig(connect=endpoint, name=name, credits=credits_, traces=False)
    return run_worker(config, WaitTask(wall_s)).code


@dataclass(slots=True)
class Light:
    """One light evaluator."""

    name: str
    link: Link
    mailbox: Mailbox
    keys: Keys
    due_s: float = 0.0

    def handle(self, event: Event) -> bool:
        """Let one event happen, trials and all; tell whether it goes on."""
        events = [event]
        while events:
            for instruction in self.mailbox.handle(events.pop(), time.monotonic()):
                match instruction:
                    case Send(message):
                        key = self.keys.up(self.name, message)
                        self.link.publish(key, encode(message))
                    case Run(trial):
                        events.append(Ended(self._result(trial)))
                    case Quit():
                        return False
                    case _:
                        pass
        now_s = time.monotonic()
        self.due_s = now_s + self.mailbox.wait_s(now_s)
        return True

    def _result(self, trial: Trial) -> Result:
        verdict = run_trial(_TASK, trial.theta, trial.seed)
        return Result(
            boot=self.mailbox.hello.boot,
            token=trial.token,
            trial=trial.trial,
            kind=verdict.kind,
            cost=verdict.cost,
            seed=trial.seed,
            engine=_TASK.engine,
            wall_s=verdict.wall_s,
        )


_TASK = WaitTask()


def crowd(endpoint: str, run: str, first: int, count: int) -> None:
    """Be many light evaluators: wait for a line, join, serve until the run ends."""
    with open_router(free_endpoint()):
        pass  # a first session brings Zenoh's own threads and tables, whoever it is for
    print("ready", flush=True)
    sys.stdin.readline()
    inbox: SimpleQueue[Any] = SimpleQueue()
    lights = {}
    for number in range(first, first + count):
        light = _join(endpoint, run, f"light-{number}", inbox, is_first=number == first)
        lights[light.name] = light
    look_s = 0.0
    while lights:
        with contextlib.suppress(Empty):
            _pass_on(lights, inbox.get(timeout=LOOK_S))
        now_s = time.monotonic()
        if now_s >= look_s:
            look_s = now_s + LOOK_S
            due = [light for light in lights.values() if now_s >= light.due_s]
            for light in due:
                if not light.handle(Tick()):
                    del lights[light.name]


def _join(endpoint: str, run: str, name: str, inbox: SimpleQueue[Any], *, is_first: bool) -> Light:
    """Connect and say hello."""
    link, keys = open_client(endpoint, settings=LIGHT), Keys(run)
    boot = f"boot-of-{name}"
    link.subscribe(keys.to_evaluator(name), inbox, threaded=False)
    if is_first:  # what is said to all is heard once in this process, and passed on
        link.subscribe(keys.all_cmd(), inbox)
    link.announce(keys.live_evaluator(name, boot))
    hello = Hello(
        boot=boot,
        version=VERSION,
        task_digest=digest(_TASK.spec),
        kind="function",
        engine=_TASK.engine,
        credits=2,
    )
    light = Light(name, link, Mailbox(hello, warm=True), keys)
    light.handle(LearnerAlive(1))
    return light


def _pass_on(lights: dict[str, Light], arrival: Arrival) -> None:
    """Give a message to whom it is for, or to all."""
    address = parse(arrival.key)
    message = decode(arrival.payload, *BY_TOPIC[address.topic])
    for name in (address.evaluator,) if address.evaluator else tuple(lights):
        if name in lights and not lights[name].handle(Heard(message)):
            del lights[name]


if __name__ == "__main__":
    die_with_parent()
    code = 0
    if sys.argv[1] == "crowd":
        crowd(sys.argv[2], sys.argv[3], int(sys.argv[4]), int(sys.argv[5]))
    else:
        code = work(sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
    os._exit(code)
