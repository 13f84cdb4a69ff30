"""Zenoh sessions: the settings that were measured, and a life cycle that never hangs.

The learner's session is the router of a star; everyone else is its client. Callbacks only put
into a queue, errors are one sentence, closing is bounded. This module moves bytes between keys:
it knows neither messages nor what a run is about. Sessions do not survive ``fork``: processes
that use one are spawned.
"""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol, Self
from weakref import WeakSet

from shearline.protocol.codec import BULK_BYTES_MAX, CONTROL_BYTES_MAX
from shearline.protocol.endpoints import (
    check_endpoint,
    plain,
    why_nobody,
    why_not_listening,
)
from shearline.protocol.errors import LinkError
from shearline.protocol.intake import Arrival, Intake, Presence
from shearline.protocol.keys import ROOT

if TYPE_CHECKING:
    import zenoh

#: Silence after which a peer counts as gone [ms]; 500 ms gave false alarms on a loaded machine.
LEASE_MS = 2000

#: Evaluators, observers and operators that one learner admits.
SESSIONS_MAX = 4096

#: Keys whose way is remembered: three for each evaluator that a learner admits, and some. Names
#: that never come back must not fill the memory.
PUBLISHERS_MAX = 4 * SESSIONS_MAX

#: Messages that wait in an intake before their senders are slowed down: more than evaluators ever
#: have on their way honestly, and bounded memory whatever they send.
INTAKE_MAX = 1024

#: Threads of Zenoh: one receives, for all sessions of the process, and accepts and connects too. A
#: second receiver only takes turns with it: either way all wait once an intake is full. A thread
#: that only connects (``app``) would from then on be woken first by all that comes in, merely to
#: wake the receiver.
_RUNTIME = "(rx: (worker_threads: 1), acc: (handover: rx), app: (handover: rx))"

#: Longest single attempt to connect, so that Ctrl-C and a deadline are noticed in between [s].
_SLICE_S = 0.5

#: For both sides. What is not spelled here is Zenoh's default, which listens on every interface
#: and joins any network it finds: never open a session from a bare configuration.
_COMMON: Mapping[str, object] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    # Waits for scouts that are off: costs half a second at every start of a router.
    "scouting/delay": 0,
    # Gains nothing at these sizes, and size limits are not enforced on it.
    "transport/shared_memory/enabled": False,
    "transport/link/tx/lease": LEASE_MS,
    "connect/retry": {"period_init_ms": 50, "period_max_ms": 400, "period_increase_factor": 2},
    # A put to a stopped process else blocks the sender for 5 s.
    "transport/link/tx/queue/congestion_control/block/wait_before_close": 500_000,
    # What may be dropped is, once its queue is full: with Zenoh's 2 batches of 64 kB, 1 in 25
    # traces of 100 kB was, on a loaded machine. Observer streams have a queue of their own.
    "transport/link/tx/queue/size/data": 16,
    "transport/link/tx/queue/size/data_low": 16,
    "transport/link/rx/max_message_size": 2 * BULK_BYTES_MAX,
}

#: What is larger than any message to learner or evaluator is dropped before it waits for anyone.
_SMALL_ONLY = [
    {
        "id": "control",
        "flows": ["ingress"],
        "messages": ["put", "delete", "query", "reply"],
        "key_exprs": [f"{ROOT}/*/{whose}/**" for whose in ("ev", "all", "op")],
        "size_limit": CONTROL_BYTES_MAX,
    }
]

#: For a client that only ever sends and hears single small messages: half the memory.
LIGHT: Mapping[str, object] = {
    "transport/link/tx/batch_size": 2048,
    "transport/link/tx/queue/size/data": 2,
    "transport/link/tx/queue/size/data_low": 2,
    "transport/link/rx/buffer_size": 2048,
}

_open_links: WeakSet[Link] = WeakSet()


class Sink(Protocol):
    """Where a callback may put what came: a queue, or anything that takes without waiting."""

    def put(self, item: Any, /) -> None:
        """Take one :class:`Arrival` or :class:`Presence`; never block, never raise."""
        ...


class Link:
    """One open session.

    Threads may publish at the same time; everything else belongs to the thread that opened it.

    Args:
        session: Open session, owned from here on.
        endpoint: Where it listens or what it connects to, for messages to people.
    """

    def __init__(self, session: zenoh.Session, endpoint: str) -> None:
        import zenoh  # noqa: PLC0415 - 30 ms that a command without a network need not pay

        self.endpoint = endpoint
        self._session = session
        self._block = zenoh.CongestionControl.BLOCK
        self._drop = zenoh.CongestionControl.DROP
        self._put = zenoh.SampleKind.PUT
        self._usual = zenoh.Priority.DATA
        self._low = zenoh.Priority.DATA_LOW
        self._remote = zenoh.Locality.REMOTE
        self._declared: list[Any] = []
        self._publishers: dict[tuple[str, bool | None], Any] = {}
        self._closed = False
        _open_links.add(self)
        _guard_exit()

    def publish(self, key: str, payload: bytes, *, wait: bool = True) -> None:
        """Send bytes in order and without loss while the connection lasts; else they vanish.

        Args:
            key: Where.
            payload: What.
            wait: Block on a peer that does not read, for at most half a second; else drop.
        """
        publisher = self._publishers.get((key, wait))
        if publisher is None:
            publisher = self._publisher(key, wait)
        publisher.put(payload)

    def _publisher(self, key: str, wait: bool | None) -> Any:  # noqa: FBT001 - one of three ways
        """Declare a key: Zenoh then remembers the way, which it else seeks at each put.

        Args:
            key: Where.
            wait: Block, drop, or ``None``: drop and stand behind everything else.
        """
        if len(self._publishers) >= PUBLISHERS_MAX:
            self._publishers = {}  # they undeclare themselves once nobody uses them
        publisher = self._session.declare_publisher(
            key,
            congestion_control=self._block if wait else self._drop,
            priority=self._low if wait is None else self._usual,
            allowed_destination=self._remote,
        )
        self._publishers[key, wait] = publisher
        return publisher

    def observe(self, key: str, payload: bytes) -> None:
        """Send bytes that may be dropped, overtake nothing and never make the sender wait."""
        self._observed(key).put(payload)

    def is_observed(self, key: str) -> bool:
        """Tell whether anyone listens at the moment: what nobody hears need not be made."""
        return bool(self._observed(key).matching_status.matching)

    def _observed(self, key: str) -> Any:
        publisher = self._publishers.get((key, None))
        return self._publisher(key, None) if publisher is None else publisher

    def subscribe(self, pattern: str, inbox: Sink, *, threaded: bool = True) -> None:
        """Put an :class:`Arrival` into ``inbox`` for everything that others send on a pattern.

        In the order of each sender; what comes on another subscription may overtake it.

        Args:
            pattern: What to hear.
            inbox: Where it goes.
            threaded: From a thread of its own. Without one the session's other messages wait
                meanwhile, but a process can have hundreds of sessions.
        """
        import zenoh  # noqa: PLC0415 - as above

        def enqueue(sample: zenoh.Sample) -> None:
            inbox.put(Arrival(str(sample.key_expr), sample.payload.to_bytes()))

        self._declared.append(
            self._session.declare_subscriber(
                pattern,
                zenoh.handlers.Callback(enqueue, indirect=threaded),
                allowed_origin=self._remote,
            )
        )

    def intake(self, pattern: str, waker: str) -> Intake:
        """Return a queue of everything that others send on a pattern, for one thread to wait at.

        Args:
            pattern: What to hear.
            waker: A key that matches the pattern and that nobody else uses.
        """
        import zenoh  # noqa: PLC0415 - as above

        subscriber = self._session.declare_subscriber(
            pattern, zenoh.handlers.FifoChannel(INTAKE_MAX)
        )
        self._declared.append(subscriber)
        return Intake(
            subscriber,
            self._session.declare_publisher(
                waker,
                congestion_control=self._block,
                allowed_destination=zenoh.Locality.SESSION_LOCAL,
            ),
        )

    def watch(self, pattern: str, inbox: Sink) -> None:
        """Put a :class:`Presence` into ``inbox`` for each token there is, comes or goes."""

        def enqueue(sample: zenoh.Sample) -> None:
            inbox.put(Presence(str(sample.key_expr), sample.kind == self._put))

        tokens = self._session.liveliness()
        self._declared.append(tokens.declare_subscriber(pattern, enqueue, history=True))

    @contextmanager
    def watching(self, pattern: str, inbox: Sink) -> Iterator[None]:
        """Like :meth:`watch`, for as long as the block lasts."""
        self.watch(pattern, inbox)
        watcher = self._declared.pop()
        try:
            yield
        finally:
            watcher.undeclare()

    def announce(self, key: str) -> None:
        """Declare a liveliness token, held until the link closes: last, when all else is ready."""
        self._declared.append(self._session.liveliness().declare_token(key))

    def is_connected(self) -> bool:
        """Tell whether at least one other session is connected."""
        return bool(self._session.info.transports())

    def close(self, timeout_s: float = 1.0) -> bool:
        """Close the session, in the background after ``timeout_s`` (12.7 s on a frozen peer).

        Returns:
            Whether it closed in time; if not, end the process with ``os._exit``.
        """
        if self._closed:
            return True
        self._closed = True
        closer = threading.Thread(target=self._session.close, daemon=True)
        closer.start()
        closer.join(timeout_s)
        return not closer.is_alive()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_router(listen: str, *, settings: Mapping[str, object] | None = None) -> Link:
    """Open the learner's session and listen.

    Args:
        listen: Endpoint, e.g. ``"tcp/0.0.0.0:7447"``.
        settings: Further Zenoh settings by path (TLS, access control).

    Raises:
        LinkError: If the endpoint is malformed, taken or not of this machine.
    """
    import zenoh  # noqa: PLC0415 - as above

    chosen = {
        "mode": "router",
        "listen/endpoints": [check_endpoint(listen)],
        "connect/endpoints": [],
        "transport/unicast/max_sessions": SESSIONS_MAX,
        "transport/unicast/accept_pending": SESSIONS_MAX,
        "low_pass_filter": _SMALL_ONLY,
        **(settings or {}),
    }
    try:
        return Link(_open(chosen), listen)
    except zenoh.ZError as fault:
        raise LinkError(why_not_listening(listen, str(fault))) from None


def open_client(
    connect: str,
    timeout_s: float | None = 5.0,
    *,
    cancelled: Callable[[], bool] | None = None,
    settings: Mapping[str, object] | None = None,
) -> Link:
    """Open a session as a client of the learner; it reconnects by itself from then on.

    Args:
        connect: The learner's endpoint, e.g. ``"tcp/192.168.1.5:7447"``.
        timeout_s: How long to try [s]; ``None`` tries for ever.
        cancelled: Asked at least every 0.5 s; true ends the attempt.
        settings: Further Zenoh settings by path (TLS).

    Raises:
        LinkError: If the endpoint is malformed, or nobody answers in time.
    """
    import zenoh  # noqa: PLC0415 - as above

    check_endpoint(connect)
    end_s = _end_s(timeout_s)
    while True:
        slice_s = min(_SLICE_S, max(end_s - time.monotonic(), 0.05))
        chosen = {
            "mode": "client",
            "connect/endpoints": [connect],
            "listen/endpoints": [],
            "connect/timeout_ms": round(1000 * slice_s),
            **(settings or {}),
        }
        try:
            return Link(_open(chosen), connect)
        except zenoh.ZError as fault:
            if "Unable to connect" not in str(fault):
                raise LinkError(f"cannot connect to {connect}: {plain(str(fault))}") from None
        if cancelled is not None and cancelled():
            raise LinkError(f"stopped waiting for a learner at {connect}")
        if timeout_s is not None and time.monotonic() >= end_s:
            raise LinkError(why_nobody(connect, timeout_s))


@cache
def _guard_exit() -> None:
    """See that a link somebody forgot to close cannot hang the interpreter.

    Zenoh calls back from threads that Python waits for before it runs ``atexit`` functions; a
    thread that waits for the main thread comes before both. It is no daemon: those are cut off
    in mid-close, which aborts the process.
    """

    def close_all() -> None:
        threading.main_thread().join()
        for link in list(_open_links):
            link.close()

    threading.Thread(target=close_all, name="link-exit").start()


def _open(settings: Mapping[str, object]) -> zenoh.Session:
    import zenoh  # noqa: PLC0415 - as above

    os.environ.setdefault("ZENOH_RUNTIME", _RUNTIME)  # read once, at a process's first session
    config = zenoh.Config()
    for path, value in {**_COMMON, **settings}.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def _end_s(timeout_s: float | None) -> float:
    return time.monotonic() + (float("inf") if timeout_s is None else timeout_s)
