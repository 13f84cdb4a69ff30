"""A light evaluator over the real network: answers every attempt at once, in a thread."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue

from shearline.protocol.codec import TO_EVALUATOR, decode, encode
from shearline.protocol.discovery import discover
from shearline.protocol.errors import ProtocolError
from shearline.protocol.intake import Arrival
from shearline.protocol.keys import Keys
from shearline.protocol.link import open_client
from shearline.protocol.messages import (
    VERSION,
    Ack,
    Bye,
    Command,
    CommandKind,
    Credit,
    Hello,
    Message,
    OutcomeKind,
    Refused,
    Result,
    Trial,
    Verdict,
    Welcome,
)

RESEND_S = 0.1


def succeed(trial: Trial) -> tuple[OutcomeKind, float, str]:
    """Return an outcome that depends on the tuple alone."""
    cost = sum(x * x for x in trial.theta)
    return (OutcomeKind.SUCCESS if trial.theta[0] > 0 else OutcomeKind.FAILURE), cost, ""


class LightEvaluator(threading.Thread):
    """One evaluator.

    Args:
        endpoint: The learner's.
        name: Its name.
        answer: Returns kind, cost and why of a trial.
        last: After so many answers it vanishes without a word.

    Attributes:
        verdicts: What was acknowledged, by token.
        refused: Why it was refused, if it was.
    """

    def __init__(
        self,
        endpoint: str,
        name: str = "light",
        answer: Callable[[Trial], tuple[OutcomeKind, float, str]] = succeed,
        last: int | None = None,
    ) -> None:
        super().__init__(name=name, daemon=True)
        self.verdicts: dict[str, Verdict] = {}
        self.refused = ""
        self._endpoint = endpoint
        self._answer = answer
        self._last = last
        self._boot = secrets.token_hex(8)
        self._unacked: dict[str, Result] = {}
        self._welcomed = False
        self._over = False
        self._seq = 0

    def run(self) -> None:
        """Answer until told to stop, refused, or at the last."""
        inbox: SimpleQueue[Arrival] = SimpleQueue()
        with open_client(self._endpoint, 10.0) as link:
            run, _ = discover(link, 10.0)
            keys = Keys(run)
            for pattern in (keys.to_evaluator(self.name), keys.all_cmd()):
                link.subscribe(pattern, inbox)
            link.announce(keys.live_evaluator(self.name, self._boot))

            def say(message: Message) -> None:
                link.publish(keys.up(self.name, message), encode(message))

            while not self._over and self._last != 0:
                try:
                    message = decode(inbox.get(timeout=RESEND_S).payload, *TO_EVALUATOR)
                    self._hear(message, say)
                except ProtocolError:
                    continue  # a rogue may say anything on any key
                except Empty:
                    self._repeat(say)

    def _hear(self, message: Message, say: Callable[[Message], None]) -> None:
        match message:
            case Welcome():
                self._welcomed = True
            case Trial():
                for token in message.counted:
                    self._hear(Ack(boot=message.boot, token=token, verdict=Verdict.COUNTED), say)
                self._try(message, say)
            case Ack():
                self._unacked.pop(message.token, None)
                self.verdicts[message.token] = message.verdict
            case Command(kind=CommandKind.STOP):
                say(Bye(boot=self._boot))
                self._over = True
            case Refused():
                self.refused, self._over = message.why, True

    def _try(self, trial: Trial, say: Callable[[Message], None]) -> None:
        kind, cost, why = self._answer(trial)
        result = Result(
            boot=self._boot,
            token=trial.token,
            trial=trial.trial,
            kind=kind,
            cost=cost,
            seed=trial.seed,
            engine="light",
            why=why,
        )
        self._unacked[trial.token] = result
        say(result)
        if self._last is not None:
            self._last -= 1

    def _repeat(self, say: Callable[[Message], None]) -> None:
        for result in self._unacked.values():
            say(result)
        self._seq += 1
        if self._welcomed:
            say(Credit(boot=self._boot, seq=self._seq, credits=2))
        else:
            say(
                Hello(
                    boot=self._boot,
                    version=VERSION,
                    task_digest="",
                    kind="function",
                    engine="light",
                    credits=2,
                )
            )
