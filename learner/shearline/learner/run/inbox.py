"""The inbox: the one queue between network callbacks and the owner thread, and it is bounded.

When a peer floods, what peers repeat anyway is dropped: first what it sends beyond its share, so
that the others do not wait behind it; should many names flood, the heartbeats, then everything
that came over the network. What the learner's own threads put in always gets through.
"""

from __future__ import annotations

from queue import SimpleQueue
from typing import Any

from shearline.protocol.link import Arrival

#: A backlog that honest evaluators cause together at times; up to it nobody is counted.
BACKLOG = 256

#: What one sender may add to a longer backlog until it is gone: an honest one waits for its
#: answers, so that only a few messages of it are ever on their way.
SHARE_MAX = 64

#: Senders counted at once; beyond, counting begins anew rather than growing without bound.
SENDERS_MAX = 65_536

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
        self._shares: dict[str, int] = {}

    def put(self, item: object, block: bool = True, timeout: float | None = None) -> None:  # noqa: FBT001, FBT002 - the signature of the base
        """Enter an item, unless it is one that its sender repeats and too many wait."""
        if isinstance(item, Arrival) and not self._admits(item):
            self.dropped += 1
            return
        super().put(item, block, timeout)

    def _admits(self, arrival: Arrival) -> bool:
        waiting = self.qsize()
        if waiting < BACKLOG:
            if self._shares:
                self._shares = {}
            return True
        if self._share(arrival.key) > SHARE_MAX:
            return False
        if waiting < HEARTBEATS_MAX:
            return True
        return waiting < ARRIVALS_MAX and not arrival.key.endswith(_HEARTBEATS)

    def _share(self, key: str) -> int:
        """Return how many items this sender has entered since the backlog was short."""
        if len(self._shares) >= SENDERS_MAX:
            self._shares = {}
        sender, _, _ = key.rpartition("/")
        self._shares[sender] = share = self._shares.get(sender, 0) + 1
        return share
