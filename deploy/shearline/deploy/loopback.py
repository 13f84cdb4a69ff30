"""One message from a client to a router and back, on this machine: does the network work here?"""

from __future__ import annotations

import statistics
import time
from queue import Empty, SimpleQueue

from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import LinkError
from shearline.protocol.intake import Arrival
from shearline.protocol.link import open_client, open_router

PING, PONG = "shearline/doctor/ping", "shearline/doctor/pong"
ROUNDS = 20
PATIENCE_S = 2.0


def round_trip_s() -> float:
    """Return the median time of a small message there and back [s].

    Raises:
        LinkError: If the sessions cannot be opened or nothing arrives.
    """
    endpoint = free_endpoint()
    asked: SimpleQueue[Arrival] = SimpleQueue()
    answered: SimpleQueue[Arrival] = SimpleQueue()
    with open_router(endpoint) as router, open_client(endpoint, PATIENCE_S) as client:
        router.subscribe(PING, asked)
        client.subscribe(PONG, answered)
        times_s = []
        for _ in range(ROUNDS):
            start_s = time.perf_counter()
            client.publish(PING, b"ping")
            try:
                asked.get(timeout=PATIENCE_S)
                router.publish(PONG, b"pong")
                answered.get(timeout=PATIENCE_S)
            except Empty:
                raise LinkError(
                    f"a message on {endpoint} did not arrive: is a firewall on?"
                ) from None
            times_s.append(time.perf_counter() - start_s)
    return statistics.median(times_s)
