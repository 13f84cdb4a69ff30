"""Finding a learner: which runs are led at an endpoint, told by their learners' liveliness."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from queue import Empty, SimpleQueue

from shearline.protocol.errors import LinkError
from shearline.protocol.intake import Presence
from shearline.protocol.keys import ANY_LEARNER, parse
from shearline.protocol.link import Link

#: Longest single wait, so that Ctrl-C and a deadline are noticed in between [s].
_SLICE_S = 0.5


def discover(
    link: Link,
    timeout_s: float | None = 5.0,
    *,
    cancelled: Callable[[], bool] | None = None,
    besides: Collection[tuple[str, int]] = (),
) -> tuple[str, int]:
    """Wait for a learner to be alive.

    Args:
        link: Open client session.
        timeout_s: How long to wait [s]; ``None`` waits for ever.
        cancelled: Asked at least every 0.5 s; true ends the wait.
        besides: Runs and epochs that do not count.

    Returns:
        Its run's name and its epoch; the newest epoch where several are seen.

    Raises:
        LinkError: If none shows up in time.
    """
    inbox: SimpleQueue[Presence] = SimpleQueue()
    alive: set[tuple[str, int]] = set()
    end_s = time.monotonic() + (float("inf") if timeout_s is None else timeout_s)
    with link.watching(ANY_LEARNER, inbox):
        while True:
            note_learners(alive, inbox, min(_SLICE_S, max(end_s - time.monotonic(), 0.0)))
            fresh = alive.difference(besides)
            if fresh:
                return max(fresh, key=lambda learner: learner[1])
            if cancelled is not None and cancelled():
                raise LinkError(f"stopped waiting for a learner at {link.endpoint}")
            if time.monotonic() >= end_s:
                raise LinkError(
                    f"connected to {link.endpoint}, but no learner is alive there within"
                    f" {timeout_s:g} s: start one"
                )


def note_learners(alive: set[tuple[str, int]], inbox: SimpleQueue[Presence], wait_s: float) -> None:
    """Bring ``(run, epoch)`` of living learners up to date from what a watch has put in."""
    try:
        presence = inbox.get(timeout=wait_s)
        while True:
            address = parse(presence.key)
            learner = (address.run, int(address.life))
            alive.add(learner) if presence.alive else alive.discard(learner)
            presence = inbox.get_nowait()
    except Empty:
        return
