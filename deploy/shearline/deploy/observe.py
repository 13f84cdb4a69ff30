"""Hear what a run says to everyone, and speak to it as its operator. Never slows it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue
from typing import Self

from shearline.protocol.codec import TO_OBSERVER, decode, encode
from shearline.protocol.discovery import discover
from shearline.protocol.errors import LinkError, ProtocolError
from shearline.protocol.intake import Arrival
from shearline.protocol.keys import Keys, parse
from shearline.protocol.link import Link, open_client
from shearline.protocol.messages import Command, CommandKind, Message, Status

#: A living learner says its status twice a second; this is several of those.
STATUS_WITHIN_S = 3.0


class Observer:
    """A client that listens to one run's status.

    Args:
        link: Open client session; closed with the observer.
        run: The run's name.
    """

    def __init__(self, link: Link, run: str) -> None:
        self.keys = Keys(run)
        self._link = link
        self._inbox: SimpleQueue[Arrival] = SimpleQueue()
        link.subscribe(f"{self.keys.root}/obs/status", self._inbox)

    @classmethod
    def attach(
        cls,
        endpoint: str,
        *,
        timeout_s: float | None = 5.0,
        cancelled: Callable[[], bool] | None = None,
    ) -> Self:
        """Connect to whatever run is alive at an endpoint.

        Raises:
            LinkError: If nobody answers, or no learner is alive there, in time.
        """
        link = open_client(endpoint, timeout_s, cancelled=cancelled)
        try:
            run, _ = discover(link, timeout_s, cancelled=cancelled)
        except BaseException:
            link.close()
            raise
        return cls(link, run)

    def statuses(self, wait_s: float) -> Iterator[Status]:
        """Yield every status that has come, waiting up to ``wait_s`` for the first."""
        try:
            arrival = self._inbox.get(timeout=wait_s)
            while True:
                message = _decoded(arrival)
                if isinstance(message, Status):
                    yield message
                arrival = self._inbox.get_nowait()
        except Empty:
            return

    def status(self, timeout_s: float = STATUS_WITHIN_S) -> Status:
        """Return the next status.

        Raises:
            LinkError: If none comes in time.
        """
        until_s = time.monotonic() + timeout_s
        while (left_s := until_s - time.monotonic()) > 0.0:
            for status in self.statuses(left_s):
                return status
        raise LinkError(
            f"the learner of run {self.keys.run} said nothing for {timeout_s:g} s:"
            " it hangs, or it ended just now"
        )

    def command(self, kind: CommandKind, why: str) -> None:
        """Ask the learner, as its operator."""
        self._link.publish(self.keys.op_cmd(), encode(Command(kind=kind, why=why)))

    def is_learner_alive(self) -> bool:
        """Tell whether a learner of this run is alive right now."""
        try:
            return discover(self._link, 0.5)[0] == self.keys.run
        except LinkError:
            return False

    def close(self) -> None:
        """Close the session; bounded."""
        self._link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _decoded(arrival: Arrival) -> Message | None:
    """Return the message, or ``None`` for what is not one: an observer ignores noise."""
    try:
        parse(arrival.key)
        return decode(arrival.payload, *TO_OBSERVER)
    except ProtocolError:
        return None
