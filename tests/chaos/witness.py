"""A client that overhears what evaluators are told, to be compared with the journal afterwards."""

from __future__ import annotations

from queue import Empty, SimpleQueue

from shearline.protocol.codec import decode
from shearline.protocol.errors import ProtocolError
from shearline.protocol.intake import Arrival
from shearline.protocol.keys import Keys
from shearline.protocol.link import open_client
from shearline.protocol.messages import Ack, Message, Trial, Verdict

_TOLD: tuple[type[Message], ...] = (Ack, Trial)


class Witness:
    """Hears every trial and acknowledgement of a run, across lives of its learner.

    Args:
        endpoint: The learner's.
        run: The run's name.
    """

    def __init__(self, endpoint: str, run: str) -> None:
        self._heard: SimpleQueue[Arrival] = SimpleQueue()
        self._link = open_client(endpoint, 60.0)
        for topic in ("trial", "ack"):
            self._link.subscribe(f"{Keys(run).root}/ev/*/{topic}", self._heard)

    def told(self) -> list[Ack | Trial]:
        """Return what was heard since the last call."""
        messages: list[Ack | Trial] = []
        while True:
            try:
                payload = self._heard.get_nowait().payload
            except Empty:
                return messages
            try:
                message = decode(payload, *_TOLD)
            except ProtocolError:
                continue  # somebody's garbage
            if isinstance(message, Trial):
                boot, verdict = message.boot, Verdict.COUNTED
                messages += [Ack(boot=boot, token=t, verdict=verdict) for t in message.counted]
            if isinstance(message, Ack | Trial):
                messages.append(message)

    def close(self) -> None:
        """Stop listening."""
        self._link.close()
