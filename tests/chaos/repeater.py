"""A client that overhears results and says a share of them again, several times, at once and later.

Run as ``python repeater.py ENDPOINT RUN SHARE TIMES``; goes on until it is ended.
"""

from __future__ import annotations

import random
import sys
from collections import deque
from queue import Empty, SimpleQueue

from shearline.deploy.processes import die_with_parent
from shearline.protocol.intake import Arrival
from shearline.protocol.keys import Keys
from shearline.protocol.link import open_client

#: Results kept to be said again long after their acknowledgement.
KEPT_MAX = 64


def main(endpoint: str, run: str, share: float, times: int) -> None:
    """Say results again for ever."""
    heard: SimpleQueue[Arrival] = SimpleQueue()
    kept: deque[Arrival] = deque(maxlen=KEPT_MAX)
    dice = random.Random(0)
    with open_client(endpoint, None) as link:
        link.subscribe(f"{Keys(run).root}/ev/*/result", heard)
        while True:
            try:
                arrival = heard.get(timeout=0.25)
            except Empty:
                arrival = None
            if arrival is not None and dice.random() < share:
                kept.append(arrival)
                for _ in range(times):
                    link.publish(arrival.key, arrival.payload)
            if kept:
                old = dice.choice(kept)
                link.publish(old.key, old.payload)


if __name__ == "__main__":
    die_with_parent()
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4]))
