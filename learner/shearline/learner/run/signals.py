"""Signals as commands: the first asks the run to stop, the second does not wait for it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

from shearline.learner.dispatcher.events import OperatorCommand
from shearline.protocol.link import Sink
from shearline.protocol.messages import CommandKind

_CAUGHT = (signal.SIGINT, signal.SIGTERM)


@dataclass(frozen=True, slots=True)
class Hurry:
    """End now, whatever still runs."""


@contextmanager
def signals_to(inbox: Sink) -> Iterator[None]:
    """Put a stop into the inbox at the first SIGINT or SIGTERM, and :class:`Hurry` after it.

    Only the main thread hears signals; in any other this does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []

    def hear(number: int, _frame: FrameType | None) -> None:
        heard.append(number)
        why = f"interrupted ({signal.Signals(number).name}): start it again to resume"
        inbox.put(Hurry() if len(heard) > 1 else OperatorCommand(CommandKind.STOP, why))

    before = {number: signal.signal(number, hear) for number in _CAUGHT}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
