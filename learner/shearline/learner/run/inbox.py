"""The inbox: everything for the owner thread, and who may fill it.

What evaluators say waits in a bounded queue of the session (see the intake): who floods is slowed
down by its own connection and nothing is lost. When more waits than honest evaluators cause, only
what could mean anything is let in (see the doorman), and of that only a share for each key, so that
nobody waits behind who floods. What comes by callback, commands and lives, is dropped beyond a
backlog unless it is minded: it is repeated. What the learner's own threads put in always gets
through.
"""

from __future__ import annotations

from shearline.learner.run.doorman import Doorman, is_oversized
from shearline.protocol.intake import Arrival, Intake, Presence

#: Items taken in one step: one write for all of them, and a bound on how long a step takes.
STEP_ITEMS_MAX = 32

#: Messages looked at in one step, most of which are then refused.
STEP_LOOKS_MAX = 1024

#: Commands and lives that wait at times; up to it nobody is asked who it is.
BACKLOG = 256

#: What may be taken on one key before there is room again: an honest evaluator waits for its
#: answers, so that only a few messages of it are ever on their way.
SHARE_MAX = 64

#: The same for introductions, which anyone may send; one a second is what an honest one sends.
HELLOS_MAX = 4

#: Keys counted at once; beyond, counting begins anew rather than growing without bound.
KEYS_MAX = 65_536


class Inbox:
    """Everything for one thread.

    Args:
        intake: Where that thread waits.
        doorman: Knows who could mean anything; without one everyone is let in.

    Attributes:
        dropped: How many items were refused.
    """

    def __init__(self, intake: Intake, doorman: Doorman | None = None) -> None:
        self.dropped = 0
        self._intake = intake
        self._doorman = doorman
        self._is_crowded = False
        self._shares: dict[str, int] = {}

    def put(self, item: object) -> None:
        """Enter an item from any thread or signal handler; see :class:`Sink` for what comes in."""
        if isinstance(item, Arrival | Presence) and not self._has_room(item):
            self.dropped += 1
            return
        self._intake.put(item)

    def take(self) -> list[object]:
        """Wait until something comes, or until woken; return a step's worth of what is there."""
        items: list[object] = []
        item = self._intake.take()
        for _ in range(STEP_LOOKS_MAX):
            if item is None:
                self._is_crowded = False
                return items
            if not isinstance(item, Arrival) or self._admits(item):
                items.append(item)
            else:
                self.dropped += 1
            if len(items) == STEP_ITEMS_MAX:
                break
            item = self._intake.take_nowait()
        if not self._is_crowded:
            self._is_crowded, self._shares = True, {}
        return items

    def _has_room(self, item: Arrival | Presence) -> bool:
        if self._intake.own < BACKLOG or self._doorman is None:
            return True
        return isinstance(item, Presence) and self._doorman.minds(item)

    def _admits(self, arrival: Arrival) -> bool:
        if is_oversized(arrival):
            return False
        if not self._is_crowded:
            return True
        if self._doorman is not None and not self._doorman.knows(arrival):
            return False
        return self._share(arrival.key) <= (
            HELLOS_MAX if arrival.key.endswith("/hello") else SHARE_MAX
        )

    def _share(self, key: str) -> int:
        """Return how many items came on this key since there was room."""
        if len(self._shares) >= KEYS_MAX:
            self._shares = {}
        self._shares[key] = share = self._shares.get(key, 0) + 1
        return share
