"""The inbox: the one queue between network callbacks and the owner thread, and it is bounded.

When more waits than honest evaluators cause, only what could mean anything is let in (see the
doorman), and of that only a share for each key, so that nobody waits behind who floods. Should many
names flood, the heartbeats are dropped, then everything that came over the network: peers repeat
it. What the learner's own threads put in always gets through.
"""

from __future__ import annotations

from queue import SimpleQueue
from typing import Any

from shearline.learner.run.doorman import Doorman, is_oversized
from shearline.protocol.link import Arrival, Presence

#: A backlog that honest evaluators cause together at times; up to it nobody is asked who it is.
BACKLOG = 256

#: What may be added on one key to a longer backlog until it is gone: an honest evaluator waits for
#: its answers, so that only a few messages of it are ever on their way.
SHARE_MAX = 64

#: The same for introductions, which anyone may send; one a second is what an honest one sends.
HELLOS_MAX = 4

#: Keys counted at once; beyond, counting begins anew rather than growing without bound.
KEYS_MAX = 65_536

#: Beyond so many waiting items, heartbeats are dropped: a second of the heaviest honest load.
HEARTBEATS_MAX = 20_000

#: Beyond so many, everything from the network is: results are sent again until acknowledged.
ARRIVALS_MAX = 50_000

_HEARTBEATS = ("/credit", "/renew", "/hello")


class Inbox(SimpleQueue[Any]):
    """A queue that never grows without bound.

    Args:
        doorman: Knows who could mean anything; without one everyone is let in.

    Attributes:
        dropped: How many items were dropped.
    """

    def __init__(self, doorman: Doorman | None = None) -> None:
        super().__init__()
        self.dropped = 0
        self._doorman = doorman
        self._shares: dict[str, int] = {}

    def put(self, item: object, block: bool = True, timeout: float | None = None) -> None:  # noqa: FBT001, FBT002 - the signature of the base
        """Enter an item, unless it is one that its sender repeats and too many wait."""
        if isinstance(item, Arrival | Presence) and not self._admits(item):
            self.dropped += 1
            return
        super().put(item, block, timeout)

    def _admits(self, item: Arrival | Presence) -> bool:
        waiting = self.qsize()
        if waiting < BACKLOG:
            if self._shares:
                self._shares = {}
            return isinstance(item, Presence) or not is_oversized(item)
        if isinstance(item, Presence):
            return waiting < ARRIVALS_MAX and (self._doorman is None or self._doorman.minds(item))
        if is_oversized(item) or not (self._doorman is None or self._doorman.knows(item)):
            return False
        if self._share(item.key) > (HELLOS_MAX if item.key.endswith("/hello") else SHARE_MAX):
            return False
        if waiting < HEARTBEATS_MAX:
            return True
        return waiting < ARRIVALS_MAX and not item.key.endswith(_HEARTBEATS)

    def _share(self, key: str) -> int:
        """Return how many items came on this key since the backlog was short."""
        if len(self._shares) >= KEYS_MAX:
            self._shares = {}
        self._shares[key] = share = self._shares.get(key, 0) + 1
        return share
