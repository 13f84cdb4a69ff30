"""Whether another learner leads a run of this name: both would answer the same evaluators.

A folder is held by one learner, but two folders of the same name may meet at a router that stands
between learners and evaluators. What cannot be seen, a learner behind a router that is down at the
moment, is not noticed.
"""

from __future__ import annotations

import time
from queue import SimpleQueue

from shearline.protocol.discovery import note_learners
from shearline.protocol.errors import ConfigError
from shearline.protocol.intake import Presence
from shearline.protocol.keys import Keys
from shearline.protocol.link import LEASE_MS, Link

#: How long a router may take to answer the call; it may also come later than the learner [s].
CONNECT_S = 0.5

#: A router tells at once who is alive; the wait ends with the first answer [s].
ANSWER_S = 0.25

#: So long a router believes in a learner that fell silent: our own earlier life, perhaps [s].
BELIEF_S = 1.5 * LEASE_MS / 1000


def refuse_namesake(link: Link, keys: Keys) -> None:
    """Look around before this learner says that it is there.

    Args:
        link: Open session, not announced yet.
        keys: The run's.

    Raises:
        ConfigError: If another learner leads a run of this name.
    """
    end_s = time.monotonic() + CONNECT_S
    while not link.is_connected():
        if time.monotonic() >= end_s:
            return
        time.sleep(CONNECT_S / 50)
    found: SimpleQueue[Presence] = SimpleQueue()
    alive: set[tuple[str, int]] = set()
    end_s = time.monotonic() + BELIEF_S
    with link.watching(keys.live_learners(), found):
        note_learners(alive, found, ANSWER_S)
        while alive and time.monotonic() < end_s:
            note_learners(alive, found, ANSWER_S)
    if alive:
        raise ConfigError(
            f"another learner leads a run called {keys.run!r} there:"
            " give this one's folder another name, or stop that one"
        )
