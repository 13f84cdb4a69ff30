"""The limit: a bare Zenoh echo between processes, put there and put back.

Nothing of ours is in the way but the session's settings: no codec, no tables, no journal. Of the
ways to write an echo in Python (callback or blocking receive, on either side) this is the
fastest: each side blocks in the receive of its own main thread.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass, field
from typing import Any

import zenoh

from shearline.deploy.processes import die_with_parent
from shearline.deploy.transport.child import Children, report, statistics
from shearline.deploy.transport.task import wait
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.link import Link, open_client, open_router

#: As large as a trial and a result of 23 parameters on the wire [bytes].
THERE_BYTES = 365
BACK_BYTES = 166

#: Round trips of each echo before the clock starts.
WARM = 100


def answer(endpoint: str, name: str, wall_s: float) -> None:
    """Send everything back, each after ``wall_s``, until the process is killed."""
    session = _session(open_client(endpoint))
    back = session.declare_publisher(
        f"echo/back/{name}", congestion_control=zenoh.CongestionControl.BLOCK
    )
    there = session.declare_subscriber(f"echo/there/{name}")
    payload = name.encode().ljust(BACK_BYTES)
    back.put(payload)  # says that we are here
    while True:
        there.recv()
        wait(wall_s)
        back.put(payload)


@dataclass(slots=True)
class Asker:
    """Asks all echoes, each with so many messages in flight.

    Args:
        session: Open session that listens.
        names: Of the echoes.
    """

    session: Any
    names: list[str]
    _puts: dict[bytes, Any] = field(init=False)
    _back: Any = field(init=False)

    def __post_init__(self) -> None:
        self._back = self.session.declare_subscriber("echo/back/*")
        self._puts = {
            name.encode().ljust(BACK_BYTES): self.session.declare_publisher(
                f"echo/there/{name}", congestion_control=zenoh.CongestionControl.DROP
            )
            for name in self.names
        }

    def wait(self) -> None:
        """Wait until all echoes are there, and heard of our subscriptions and they of ours."""
        for _ in self.names:
            self._back.recv()
        for put in self._puts.values():
            while not put.matching_status.matching:
                time.sleep(0.001)

    def ask(self, trips: int, depth: int) -> dict[str, float]:
        """Make so many round trips in all, ``depth`` in flight with each echo.

        Returns:
            ``p50_s``, ``p99_s``, ``rate_hz``.
        """
        sent_s: dict[bytes, list[float]] = {name: [] for name in self._puts}
        times_s: list[float] = []
        warm = WARM * len(self._puts)
        for name, put in self._puts.items():
            for _ in range(depth):
                sent_s[name].append(time.perf_counter())
                put.put(bytes(THERE_BYTES))
        payload = bytes(THERE_BYTES)
        began_s = 0.0
        for trip in range(trips + warm):
            name = self._back.recv().payload.to_bytes()
            now_s = time.perf_counter()
            if trip == warm:
                began_s = now_s
            times_s.append(now_s - sent_s[name].pop(0))
            sent_s[name].append(now_s)
            self._puts[name].put(payload)
        ended_s = time.perf_counter()
        for _ in range(depth * len(self._puts)):
            self._back.recv()
        return statistics(times_s[warm:]) | {"rate_hz": trips / (ended_s - began_s)}


def ask(echoes: int, trips: int, wall_s: float) -> None:
    """Measure echoes that take ``wall_s`` each; print one JSON object."""
    endpoint = free_endpoint()
    names = [f"e{i}" for i in range(echoes)]
    with open_router(endpoint) as link, Children() as children:
        asker = Asker(_session(link), names)
        for name in names:
            children.start("echo", endpoint, name, wall_s)
        asker.wait()
        cpu_s = time.process_time()
        one = asker.ask(trips, 1)
        cpu_s = time.process_time() - cpu_s
        two = asker.ask(trips, 2)
        report({"one": one, "two": two, "cpu_s": cpu_s / (trips + WARM * echoes)})


def _session(link: Link) -> Any:
    return link._session  # noqa: SLF001 - the point is to go around it


if __name__ == "__main__":
    die_with_parent()
    first, second, wall_s = sys.argv[1], sys.argv[2], float(sys.argv[3])
    if first.isdecimal():
        ask(int(first), int(second), wall_s)
    else:
        answer(first, second, wall_s)
    os._exit(0)
