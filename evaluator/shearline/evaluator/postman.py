"""The postman: all that a worker has to do with the network.

It turns what comes in into events, has the mailbox decide, and carries the instructions out: on
the trial's thread what comes while that one waits for a trial, on a thread of its own everything
else and whatever time brings. It takes no decision itself and does not know what a trial is.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any

from shearline.evaluator.mail import (
    Abort,
    Event,
    Gate,
    Heard,
    Instruction,
    LearnerAlive,
    LearnerGone,
    Leave,
    Prepare,
    Quit,
    Run,
    Send,
    Settled,
    Started,
    Tick,
)
from shearline.evaluator.mailbox import Mailbox
from shearline.protocol.codec import BY_TOPIC, decode, encode
from shearline.protocol.errors import ProtocolError
from shearline.protocol.intake import Arrival, Presence
from shearline.protocol.keys import ANY_LEARNER, Keys, parse
from shearline.protocol.link import Link
from shearline.protocol.messages import TraceData, Welcome
from shearline.protocol.scene import SceneData

log = logging.getLogger(__name__)

#: Keys repeat, and taking one apart costs as much as decoding a small message.
_parse = functools.lru_cache(maxsize=64)(parse)

#: Share of a lease after which the postman's thread looks what came during a trial; renewals are
#: due after a quarter of one.
LOOK_LEASES = 0.05

#: Longest sleep of a thread that no run employs: a signal that comes between Python's look for
#: signals and its sleep does not end it [s].
WAKE_S = 0.5

#: Malformed messages that are told to people; the others are only counted.
COMPLAINTS_MAX = 10


@dataclass(frozen=True, slots=True)
class End:
    """How it ended for this evaluator: an exit code and one sentence."""

    code: int
    why: str


@dataclass(slots=True)
class Exchange:
    """What the trial's thread and the postman's thread share.

    The trial's thread waits at the intake while it has nothing to run, so that a trial is not
    handed from thread to thread; while it runs one, the postman's thread looks there now and then.
    ``lock`` is held by whoever acts; queues are safe from anywhere, signal handlers included.

    Attributes:
        inbox: Events, presences, traces and what was said to all, for the postman's thread.
        alarm: Wakes the postman's thread.
        calls: Wakes the trial's thread while there is no postman.
        jobs: For the trial's thread: what to run, what to prepare, or the end.
        postman: Speaks for this evaluator in the run that goes on, if one does.
        is_busy: Whether the trial's thread has something else to do than to wait at the intake.
        running: Token of the trial that runs, or ``""``; the postman's thread looks now and then,
            so that a short trial need not be spoken of.
        is_open: Whether a trial may begin.
        abort_why: Why the running trial is to end at its next beat, or ``""``.
        is_linked: Whether the learner can be reached and knows this evaluator.
        settled: Called with the token of each result that the learner has.
        leaving: What a signal asked for.
        lease_s: Lease of an attempt, as the learner last said [s].
        complaints: Malformed messages so far.
    """

    inbox: SimpleQueue[Any] = field(default_factory=SimpleQueue)
    alarm: SimpleQueue[None] = field(default_factory=SimpleQueue)
    calls: SimpleQueue[None] = field(default_factory=SimpleQueue)
    jobs: deque[Run | Prepare | End] = field(default_factory=deque)
    lock: threading.Lock = field(default_factory=threading.Lock)
    postman: Postman | None = None
    is_busy: bool = True
    running: str = ""
    is_open: bool = True
    is_linked: bool = False
    settled: Callable[[str], None] = lambda _token: None
    abort_why: str = ""
    leaving: Leave | None = None
    lease_s: float = 2.0
    complaints: int = 0

    def put(self, item: object) -> None:
        """Enter something for the postman; may be called from any thread or signal handler."""
        self.inbox.put(item)
        self.alarm.put(None)

    def leave(self, code: int, why: str) -> None:
        """Have this process leave; may be called from a signal handler."""
        if self.leaving is None:
            self.leaving = Leave(code, why)
            self.put(self.leaving)

    def is_leaving(self) -> bool:
        """Tell whether this process was asked to leave."""
        return self.leaving is not None

    def abort(self, why: str) -> None:
        """End the running trial at its next beat, and let no other begin."""
        self.abort_why = why

    def renew(self) -> None:
        """Forget what was meant for the run before."""
        with self.lock:
            self.jobs.clear()
            self.abort_why = ""
            self.is_open = True

    def employ(self, postman: Postman | None) -> None:
        """Let a postman speak from now on, or nobody."""
        with self.lock:
            before, self.postman = self.postman, postman
        self._call(before)

    def finish(self, end: End) -> None:
        """Have the trial's thread end, without beginning what waits."""
        self.abort(end.why)
        with self.lock:
            self.jobs.append(end)
        self._call(self.postman)

    def next_job(self) -> Run | Prepare | End:
        """Return what the trial's thread is to do next; until there is something, serve."""
        while True:
            with self.lock:
                postman = self.postman
                if self.jobs and postman is not None:
                    postman.clear()  # first: it may say to hold, or to stop
                if self.jobs and (self.is_open or self.abort_why or not self._waits_for_trial()):
                    self.is_busy = True
                    return self.jobs.popleft()
                self.is_busy = postman is None
            if postman is None:
                with contextlib.suppress(Empty):
                    self.calls.get(timeout=WAKE_S)
            else:
                self._await(postman)

    def tell(self, event: Event) -> None:
        """Have an event of the trial's thread acted upon at once, without another thread."""
        with self.lock:
            if self.postman is not None:
                self.postman.take(event)

    def _call(self, postman: Postman | None) -> None:
        """Have the trial's thread look for a job, wherever it waits."""
        self.calls.put(None)
        if postman is not None:
            postman.intake.wake()

    def _waits_for_trial(self) -> bool:
        return isinstance(self.jobs[0], Run)

    def _await(self, postman: Postman) -> None:
        item = postman.intake.take()
        if item is not None:
            with self.lock:
                if self.postman is postman:
                    postman.take(item)


class Postman:
    """Speaks the protocol for one evaluator in one run.

    Args:
        exchange: Shared with the trial's thread.
        link: Open session.
        keys: The run's.
        name: This evaluator's.
        mailbox: Decides.
    """

    def __init__(
        self, exchange: Exchange, link: Link, keys: Keys, name: str, mailbox: Mailbox
    ) -> None:
        self._exchange = exchange
        self._link = link
        self._keys = keys
        self._name = name
        self._mailbox = mailbox
        self._others: set[str] = set()
        self._end: End | None = None
        self.intake = link.intake(keys.to_evaluator(name), keys.wake(name))

    def serve(self, epoch: int) -> End:
        """Take part in the run until it, or this process, ends.

        Args:
            epoch: Of the learner that was discovered.
        """
        exchange = self._exchange
        self._link.subscribe(self._keys.all_cmd(), exchange)
        self._link.watch(ANY_LEARNER, exchange)
        # Last: whoever sees the token may expect everything else to work.
        boot = self._mailbox.hello.boot
        self._link.announce(self._keys.live_evaluator(self._name, boot))
        with exchange.lock:
            self.take(LearnerAlive(epoch))
        exchange.employ(self)
        try:
            while (wait_s := self._relieve()) is not None:
                with contextlib.suppress(Empty):
                    exchange.alarm.get(timeout=wait_s)
        finally:
            exchange.employ(None)
            exchange.is_linked = False
        assert self._end is not None
        return self._end

    def _relieve(self) -> float | None:
        """Do what is due; say when to look again [s], nothing at the end."""
        exchange = self._exchange
        with exchange.lock:
            if exchange.is_busy:
                self.clear()  # first: what came during a trial is renewed with it
                running = self._mailbox.running
                if exchange.running and (running is None or running.token != exchange.running):
                    self.take(Started(exchange.running))
            while not exchange.inbox.empty():
                self.take(exchange.inbox.get_nowait())
            self.take(Tick())
            if self._end is not None:
                return None
            # The trial's thread becomes busy without a sound.
            wait_s = min(self._mailbox.wait_s(time.monotonic()), LOOK_LEASES * exchange.lease_s)
            is_called = not exchange.is_busy and bool(exchange.jobs)
        if is_called:
            self.intake.wake()
        return wait_s

    def clear(self) -> None:
        """Take all that is in the intake. The caller holds the lock."""
        while (item := self.intake.take_nowait()) is not None:
            self.take(item)

    def take(self, item: object) -> None:
        """Act upon one item from the intake or inbox. The caller holds the lock."""
        event = self._read(item)
        if event is not None and self._end is None:
            self._do(event)
        if self._end is None and self._others and self._mailbox.epoch is None:
            self._do(Leave(0, f"run {min(self._others)} has begun instead"))

    def _read(self, item: object) -> Event | None:
        """Turn one item into an event, if it is one."""
        match item:
            case Arrival():
                return self._hear(item)
            case Presence():
                return self._see(item)
            case TraceData() | SceneData():
                self._show(item)
                return None
        return item  # type: ignore[return-value]  # the trial's thread puts in events only

    def _hear(self, arrival: Arrival) -> Event | None:
        try:
            address = _parse(arrival.key)
            message = decode(arrival.payload, *BY_TOPIC[address.topic])
        except ProtocolError as fault:
            self._exchange.complaints += 1
            if self._exchange.complaints <= COMPLAINTS_MAX:
                log.warning("ignored what came on %s: %s", arrival.key, fault)
            return None
        if address.run != self._keys.run:
            return None
        if isinstance(message, Welcome):
            self._exchange.lease_s = message.lease_s
        return Heard(message)

    def _see(self, presence: Presence) -> Event:
        address = parse(presence.key)
        if address.run == self._keys.run:
            epoch = int(address.life)
            return LearnerAlive(epoch) if presence.alive else LearnerGone(epoch)
        if presence.alive:
            self._others.add(address.run)
        else:
            self._others.discard(address.run)
        return Tick()

    def _show(self, message: TraceData | SceneData) -> None:
        """Offer a trace or a scene to observers; nobody waits for one that is slow."""
        try:
            self._link.observe(self._keys.obs(message, self._name), encode(message))
        except ValueError as fault:
            log.warning("a %s is not shown: %s", type(message).__name__, fault)

    def _do(self, event: Event) -> None:
        """Have one event decided and carry out what follows; note the end, if it is one."""
        for instruction in self._mailbox.handle(event, time.monotonic()):
            self._carry_out(instruction)
        self._exchange.is_linked = self._mailbox.welcomed

    def _carry_out(self, instruction: Instruction) -> None:
        exchange = self._exchange
        match instruction:
            case Send(message):
                self._link.publish(self._keys.up(self._name, message), encode(message))
            case Run() | Prepare():
                exchange.jobs.append(instruction)
            case Gate(is_open):
                exchange.is_open = is_open
            case Abort(why):
                exchange.abort(why)
            case Settled(token):
                exchange.settled(token)
            case Quit(code, why):
                self._end = End(code, why)
                exchange.alarm.put(None)
            case _:
                raise AssertionError(instruction)
