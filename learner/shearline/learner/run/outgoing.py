"""What leaves the learner: messages to evaluators, to observers, and copies for the record.

Everything is dropped rather than ever making the owner wait for a peer that does not read; what
evaluators are told goes ahead of what observers see. Nothing depends on a single message: attempts
that are not renewed are given out again, results are sent again until acknowledged, commands are
repeated.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

from msgspec.structs import replace

from shearline.learner.dispatcher.instructions import Send
from shearline.protocol.codec import encode
from shearline.protocol.keys import Keys
from shearline.protocol.link import Link
from shearline.protocol.messages import Ack, EvaluatorState, Message, Trial, Verdict, Wire

#: Copies for the record per second; beyond, they would cost the run more than they are worth.
WIRE_HZ_MAX = 2000

_log = logging.getLogger("shearline.learner")


def together(sends: Sequence[Send]) -> list[Send]:
    """Order what goes to evaluators: trials first, and acknowledgements along with them.

    An idle evaluator waits for its trial, none waits to hear that its result was taken; and each
    message costs both sides as much as a trial does.

    Args:
        sends: What one step has to say, in order.
    """
    counted: dict[tuple[str, str], list[str]] = {}
    for send in sends:
        if isinstance(send.message, Ack) and send.message.verdict is Verdict.COUNTED:
            counted.setdefault((send.evaluator, send.message.boot), []).append(send.message.token)
    trials, others, carried = [], [], set[str]()
    for send in sends:
        if isinstance(send.message, Trial):
            tokens = counted.pop((send.evaluator, send.message.boot), None)
            if tokens is not None:
                carried.update(tokens)
                trials.append(Send(send.evaluator, replace(send.message, counted=tokens)))
            else:
                trials.append(send)
        else:
            others.append(send)
    return trials + [
        send
        for send in others
        if not (isinstance(send.message, Ack) and send.message.token in carried)
    ]


class Outgoing:
    """Sends messages of one run.

    Args:
        link: Open session.
        keys: The run's.
        record: Whether every protocol message is copied for the record.
    """

    def __init__(self, link: Link, keys: Keys, *, record: bool) -> None:
        self._link = link
        self._keys = keys
        self._record = record
        self._copies = 0
        self._second = 0

    def send(self, evaluator: str, message: Message, now_s: float) -> None:
        """Send to one evaluator."""
        self._send(self._keys.down(evaluator, message), message, now_s)

    def broadcast(self, message: Message, now_s: float) -> None:
        """Send to all evaluators."""
        self._send(self._keys.all_cmd(), message, now_s)

    def is_observed(self) -> bool:
        """Tell whether anyone observes anything of the run at the moment."""
        return self._link.is_observed(self._keys.observed())

    def publish(self, message: Message) -> None:
        """Let observers know, if there are any."""
        evaluator = message.evaluator if isinstance(message, EvaluatorState) else ""
        key = self._keys.obs(message, evaluator)
        if not self._link.is_observed(key):
            return
        try:
            payload = encode(message)
        except ValueError as fault:  # too large or not finite: observers miss it, the run goes on
            _log.warning("observers miss a %s: %s", type(message).__name__, fault)
            return
        self._link.observe(key, payload)

    def copy(self, key: str, payload: bytes, now_s: float, *, sent: bool) -> None:
        """Copy one protocol message for the record, unless there are far too many."""
        if not self._record:
            return
        if int(now_s) != self._second:
            self._second, self._copies = int(now_s), 0
        self._copies += 1
        if self._copies <= WIRE_HZ_MAX:
            self.publish(Wire(sent=sent, key=key, payload=payload, at_s=now_s))

    def _send(self, key: str, message: Message, now_s: float) -> None:
        payload = encode(message)
        self._link.publish(key, payload, wait=False)
        self.copy(key, payload, now_s, sent=True)
