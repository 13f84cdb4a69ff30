"""The intake: the one place where a thread waits, for the network and for its own process.

Zenoh fills its queue without Python's lock and without a thread of Python's, which a callback
needs: a message comes 40 us sooner and costs half of the processor time. The queue is bounded; a
sender that floods is slowed down by its own connection, and nothing is dropped. The price is that
only one thread may wait here, and that whoever waits can be woken only by a message: one that
goes from the session to itself.
"""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

import msgspec

if TYPE_CHECKING:
    import zenoh


#: After a short wait the next is likely short as well, and whoever sleeps is woken late: the core
#: has gone to sleep with it (50 to 100 us on a virtual machine, and dearer than to look on). So one
#: that waited no longer than this [s] ...
BRISK_S = 0.0004

#: ... looks for so long the next time before it sleeps [s]. Who waits for long hardly ever looks.
LOOK_S = 0.00025


class Arrival(msgspec.Struct, frozen=True):
    """Bytes that came in on a key."""

    key: str
    payload: bytes


class Presence(msgspec.Struct, frozen=True):
    """A liveliness token appeared (``alive``) or vanished."""

    key: str
    alive: bool


class Intake:
    """Everything for one thread, in one queue.

    Args:
        subscriber: What others send; it holds a channel and no callback.
        waker: Publishes to that very subscriber and nowhere else.
    """

    def __init__(self, subscriber: Any, waker: zenoh.Publisher) -> None:
        import zenoh  # noqa: PLC0415 - 30 ms that a command without a network need not pay

        self._closed = zenoh.ZError
        self._channel = subscriber.handler
        self._subscriber = subscriber
        self._waker = waker
        self._wakes_on = str(waker.key_expr)
        self._own: deque[object] = deque()
        self._is_woken = False
        self._is_brisk = False
        self._taker = 0

    @property
    def own(self) -> int:
        """How many items of this process wait."""
        return len(self._own)

    @contextmanager
    def woken_every(self, period_s: float) -> Iterator[None]:
        """Have :meth:`take` return at least this often while the block lasts [s]."""
        over = threading.Event()

        def wake() -> None:
            while not over.wait(period_s):
                self.wake()

        thread = threading.Thread(target=wake, name="intake-clock", daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def put(self, item: object) -> None:
        """Enter an item of this process; from any thread.

        From a signal handler of the thread that waits here it does not wake, since the queue may
        be full and the thread would wait for itself: the item is found at the next waking.
        """
        self._own.append(item)
        if threading.get_ident() != self._taker:
            self.wake()

    def wake(self) -> None:
        """Have :meth:`take` return, if only with nothing; not from the thread that takes."""
        if not self._is_woken:
            self._is_woken = True
            with suppress(self._closed):
                self._waker.put(b"")

    def take(self) -> object | None:
        """Wait for one item and return it; ``None`` if only woken, or if the session is closed."""
        self._taker = threading.get_ident()
        if self._own:
            return self._own.popleft()
        began_s = time.perf_counter()
        try:
            sample = self._look_until(began_s + LOOK_S) if self._is_brisk else None
            if sample is None:
                sample = self._channel.recv()
                self._is_brisk = time.perf_counter() - began_s < BRISK_S
            return self._item(sample)
        except self._closed:
            return None

    def _look_until(self, end_s: float) -> zenoh.Sample | None:
        """Look again and again, and let everyone else go first each time."""
        while time.perf_counter() < end_s:
            sample: zenoh.Sample | None = self._channel.try_recv()
            if sample is not None:
                return sample
            os.sched_yield()
        return None

    def take_nowait(self) -> object | None:
        """Return one item if there is one that is at hand."""
        if self._own:
            return self._own.popleft()
        try:
            while (sample := self._channel.try_recv()) is not None:
                item = self._item(sample)
                if item is not None:
                    return item
        except self._closed:
            pass
        return None

    def _item(self, sample: zenoh.Sample) -> object | None:
        key = str(sample.key_expr)
        if key == self._wakes_on:
            self._is_woken = False
            return self._own.popleft() if self._own else None
        return Arrival(key, sample.payload.to_bytes())
