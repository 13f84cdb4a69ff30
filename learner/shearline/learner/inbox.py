"""The inbox: the one queue between network callbacks and the owner thread, and it is bounded.

When a peer floods, what peers repeat anyway is dropped: first the heartbeats, then everything
that came over the network. What the learner's own threads put in always gets through.
"""

from __future__ import annotations

from queue import SimpleQueue
from typing import Any

from shearline.protocol.link import Arrival

#: Beyond so many waiting items, heartbeats are dropped: a second of the heaviest honest load.
HEARTBEATS_MAX = 20_000

#: Beyond so many, everything from the network is: results are sent again until acknowledged.
ARRIVALS_MAX = 50_000

_HEARTBEATS = ("/credit", "/renew", "/hello")


class Inbox(SimpleQueue[Any]):
    """A queue that never grows without bound.

    Attributes:
        dropped: How many items were dropped.
    """

    def __init__(self) -> None:
        super().__init__()
        self.dropped = 0

    def put(self, item: object, block: bool = True, timeout: float | None = None) -> None:  # noqa: FBT001, FBT002 - the signature of the base
        """Enter an item, unless it is one that its sender repeats and too many wait."""
        if isinstance(item, Arrival) and not self._admits(item):
            self.dropped += 1
            return
        super().put(item, block, timeout)

    def _admits(self, arrival: Arrival) -> bool:
        waiting = self.qsize()
        if waiting < HEARTBEATS_MAX:
            return True
        return waiting < ARRIVALS_MAX and not arrival.key.endswith(_HEARTBEATS)
