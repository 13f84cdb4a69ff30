"""The postman: all that a worker has to do with the network, on a thread of its own.

It turns what comes in into events, has the mailbox decide, and carries the instructions out.
Zenoh's callbacks only put into its queue. It takes no decision itself and does not know what a
trial is.
"""

from __future__ import annotations

import logging
import threading
import time
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
    Tick,
)
from shearline.evaluator.mailbox import Mailbox
from shearline.protocol.codec import BY_TOPIC, decode, encode
from shearline.protocol.errors import ProtocolError
from shearline.protocol.keys import ANY_LEARNER, Keys, parse
from shearline.protocol.link import Arrival, Link, Presence
from shearline.protocol.messages import TraceData, Welcome

log = logging.getLogger(__name__)

#: Malformed messages that are told to people; the others are only counted.
COMPLAINTS_MAX = 10


@dataclass(frozen=True, slots=True)
class End:
    """How it ended for this evaluator: an exit code and one sentence."""

    code: int
    why: str


@dataclass(slots=True)
class Exchange:
    """What the trial's thread and the postman share; every field is safe to use from both.

    Attributes:
        inbox: For the postman: events, arrivals, presences and traces.
        jobs: For the trial's thread: what to run, what to prepare, or the end.
        gate: Set while a trial may begin.
        abort_why: Why the running trial is to end at its next beat, or ``""``.
        leaving: What a signal asked for.
        lease_s: Lease of an attempt, as the learner last said [s].
        complaints: Malformed messages so far.
    """

    inbox: SimpleQueue[Any] = field(default_factory=SimpleQueue)
    jobs: SimpleQueue[Run | Prepare | End] = field(default_factory=SimpleQueue)
    gate: threading.Event = field(default_factory=threading.Event)
    abort_why: str = ""
    leaving: Leave | None = None
    lease_s: float = 2.0
    complaints: int = 0

    def leave(self, code: int, why: str) -> None:
        """Have this process leave; may be called from a signal handler."""
        if self.leaving is None:
            self.leaving = Leave(code, why)
            self.inbox.put(self.leaving)

    def is_leaving(self) -> bool:
        """Tell whether this process was asked to leave."""
        return self.leaving is not None

    def abort(self, why: str) -> None:
        """End the running trial at its next beat, and let no other begin."""
        self.abort_why = why
        self.gate.set()

    def renew(self) -> None:
        """Forget what was meant for the run before."""
        while not self.jobs.empty():
            self.jobs.get()
        self.abort_why = ""
        self.gate.set()


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

    def serve(self, epoch: int) -> End:
        """Take part in the run until it, or this process, ends.

        Args:
            epoch: Of the learner that was discovered.
        """
        inbox = self._exchange.inbox
        for pattern in self._keys.to_evaluator(self._name):
            self._link.subscribe(pattern, inbox)
        self._link.watch(ANY_LEARNER, inbox)
        # Last: whoever sees the token may expect everything else to work.
        boot = self._mailbox.hello.boot
        self._link.announce(self._keys.live_evaluator(self._name, boot))
        end = self._do(LearnerAlive(epoch))
        while end is None:
            try:
                item = inbox.get(timeout=self._mailbox.wait_s(time.monotonic()))
            except Empty:
                item = Tick()
            event = self._read(item)
            end = None if event is None else self._do(event)
            if end is None and self._others and self._mailbox.epoch is None:
                end = self._do(Leave(0, f"run {min(self._others)} has begun instead"))
        return end

    def _read(self, item: object) -> Event | None:
        """Turn one item from the inbox into an event, if it is one."""
        match item:
            case Arrival():
                return self._hear(item)
            case Presence():
                return self._see(item)
            case TraceData():
                self._show(item)
                return None
        return item  # type: ignore[return-value]  # the trial's thread puts in events only

    def _hear(self, arrival: Arrival) -> Event | None:
        try:
            address = parse(arrival.key)
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

    def _show(self, trace: TraceData) -> None:
        """Offer a trace to observers; nobody waits for one that is slow."""
        try:
            self._link.observe(self._keys.obs(trace, self._name), encode(trace))
        except ValueError as fault:
            log.warning("the trace of trial %d is not shown: %s", trace.trial, fault)

    def _do(self, event: Event) -> End | None:
        """Have one event decided and carry out what follows; return the end, if it is one."""
        for instruction in self._mailbox.handle(event, time.monotonic()):
            if isinstance(instruction, Quit):
                return End(instruction.code, instruction.why)
            self._carry_out(instruction)
        return None

    def _carry_out(self, instruction: Instruction) -> None:
        match instruction:
            case Send(message):
                self._link.publish(self._keys.up(self._name, message), encode(message))
            case Run() | Prepare():
                self._exchange.jobs.put(instruction)
            case Gate(is_open=True):
                self._exchange.gate.set()
            case Gate():
                self._exchange.gate.clear()
            case Abort(why):
                self._exchange.abort(why)
            case _:
                raise AssertionError(instruction)
