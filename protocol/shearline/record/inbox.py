"""The bounded space between the network's callbacks and the recorder's own thread.

Putting never waits and never grows beyond its budget: when the disk is slower than the run, the
oldest traces are thrown away first and counted, then the oldest of everything else. What is in
the payloads is not looked at; the last chunk but one of the key tells a trace.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass

from shearline.protocol.intake import Arrival, Presence

#: Some seconds of ten simulators at full rate; the recorder's memory stays near this.
BULK_BYTES_MAX = 64 * 2**20
#: All else of a run is small: this much is reached only when the disk stands still for minutes.
SMALL_BYTES_MAX = 32 * 2**20


@dataclass(frozen=True, slots=True)
class Item:
    """Bytes as they came in.

    Attributes:
        key: Key they came on.
        payload: As sent.
        at_ns: When they came [ns since the epoch].
    """

    key: str
    payload: bytes
    at_ns: int


@dataclass(slots=True)
class Dropped:
    """What was thrown away: how many, and how many bytes."""

    count: int = 0
    total_bytes: int = 0


class Inbox:
    """A queue with two budgets, in order of arrival within each.

    Args:
        bulk_bytes_max: Budget of traces [bytes].
        small_bytes_max: Budget of everything else [bytes].
    """

    def __init__(
        self,
        bulk_bytes_max: int = BULK_BYTES_MAX,
        small_bytes_max: int = SMALL_BYTES_MAX,
    ) -> None:
        self._bulk = _Lane(bulk_bytes_max)
        self._small = _Lane(small_bytes_max)
        self._learners: set[str] = set()
        self._ready = threading.Condition()

    def put(self, arrival: Arrival | Presence) -> None:
        """Take one arrival; called from the network's threads, never waits for the disk."""
        if isinstance(arrival, Presence):
            with self._ready:
                change = self._learners.add if arrival.alive else self._learners.discard
                change(arrival.key)
                self._ready.notify_all()
            return
        item = Item(arrival.key, arrival.payload, time.time_ns())
        with self._ready:
            (self._bulk if _is_trace(item.key) else self._small).add(item)
            self._ready.notify()

    def get(self, timeout_s: float) -> Item | None:
        """Return the next item, small ones first, or ``None`` after ``timeout_s``."""
        with self._ready:
            self._ready.wait_for(self._any, timeout_s)
            return self._small.take() or self._bulk.take()

    def any_learner(self) -> bool:
        """Tell whether a learner of the run is alive, as far as its tokens say."""
        with self._ready:
            return bool(self._learners)

    def wait_for_learner(self, timeout_s: float) -> bool:
        """Wait for a learner's token; tell whether one came.

        Declarations travel in order: once the token is here, the learner's session has also
        heard of every subscription declared before the watch, and nothing is missed any more.
        """
        with self._ready:
            return self._ready.wait_for(lambda: bool(self._learners), timeout_s)

    def take_dropped(self) -> tuple[Dropped, Dropped]:
        """Return what was dropped of traces and of all else since the last call."""
        with self._ready:
            return self._bulk.take_dropped(), self._small.take_dropped()

    def _any(self) -> bool:
        return bool(self._bulk.items or self._small.items)


class _Lane:
    def __init__(self, bytes_max: int) -> None:
        self.items: deque[Item] = deque()
        self._bytes_max = bytes_max
        self._bytes = 0
        self._dropped = Dropped()

    def add(self, item: Item) -> None:
        self.items.append(item)
        self._bytes += len(item.payload)
        while self._bytes > self._bytes_max:
            old = self.items.popleft()
            self._bytes -= len(old.payload)
            self._dropped.count += 1
            self._dropped.total_bytes += len(old.payload)

    def take(self) -> Item | None:
        if not self.items:
            return None
        item = self.items.popleft()
        self._bytes -= len(item.payload)
        return item

    def take_dropped(self) -> Dropped:
        dropped, self._dropped = self._dropped, Dropped()
        return dropped


def _is_trace(key: str) -> bool:
    return "/obs/trace" in key
