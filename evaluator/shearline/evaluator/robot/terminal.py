"""The robot's own terminal: the only place where an operator's consent comes from.

A thread of the arm's process reads lines from standard input. It opens no socket, and nothing that
comes over a network is ever written to where it reads. The word that stops the arm is acted upon
in that thread, whatever the others do.
"""

from __future__ import annotations

import getpass
import sys
import termios
import threading
import time
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any, NamedTuple, TextIO

from shearline.evaluator.robot.port import Consent
from shearline.evaluator.robot.states import State

#: Said before the arm is armed for the first time.
NOTICE = """\
This software is NOT a safety function. It does not replace the robot's safety controller, the
emergency stop in your hand, a fence, or a risk assessment of your cell. Tests against an emulator
show nothing about your hardware. Stay at the emergency stop whenever the arm is armed."""

STOP = "stop"

#: What may be typed while the arm works.
OTHERWISE = "type 'stop', 'pause', 'resume' or 'quit'"


class Line(NamedTuple):
    """A line that somebody typed, and when by this computer's monotonic clock [s]."""

    text: str
    at_s: float


class Closed(NamedTuple):
    """Nobody can type any more."""


class Terminal:
    """Reads lines and prints sentences.

    Args:
        inbox: Gets a :class:`Line` for each, and :class:`Closed` at the end.
        stop: Called from the reading thread as soon as :data:`STOP` was typed.
        source: Where lines come from.
        sink: Where sentences go.
    """

    def __init__(
        self,
        inbox: SimpleQueue[Any],
        stop: Callable[[], None],
        source: TextIO | None = None,
        sink: TextIO | None = None,
    ) -> None:
        self.inbox = inbox
        self._stop = stop
        self._source = source or sys.stdin
        self._sink = sink or sys.stderr

    def forget(self) -> None:
        """Drop what was typed at a keyboard before anything was asked; a pipe is a script's."""
        if self._source.isatty():
            termios.tcflush(self._source, termios.TCIFLUSH)

    def start(self) -> None:
        """Begin to read."""
        threading.Thread(target=self._read, daemon=True, name="terminal").start()

    def say(self, text: str) -> None:
        """Print a sentence for the operator; a terminal that is gone is no reason to fall."""
        try:
            print(f"robot: {text}", file=self._sink, flush=True)
        except (OSError, ValueError):
            return

    def _read(self) -> None:
        try:
            for line in self._source:
                word = line.strip().lower()
                if word == STOP:
                    self._stop()
                self.inbox.put(Line(word, time.monotonic()))
        except (OSError, ValueError):
            pass
        self.inbox.put(Closed())


def prompt(state: State, *, key_in_lock: bool, rehearsed: bool) -> str:
    """Return what the operator may do where the arm stands."""
    first = ": it will first pull the key out of the lock" if key_in_lock else ""
    said = {
        State.IDLE: f"type 'confirm' to arm the arm, 'quit' to end{first}",
        State.HOLD: "make sure that nobody is near and type 'recover', or 'quit'",
        State.FAULT: "find the cause, then type 'recover', or 'quit'",
        State.JAMMED: "free the key by hand with the gripper closed, then type 'recover'",
        State.WORN: "replace what is worn and type 'replaced key' or 'replaced lock'",
    }
    if state is State.READY and not rehearsed:
        return f"{state}: type 'confirm' to rehearse, 'quit' to end"
    return f"{state}: {said.get(state, OTHERWISE)}"


def consent(said: str) -> Consent:
    """Return what the operator said as a value that a port asks for."""
    return Consent(operator=_user(), said=said, at_s=time.time())


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "unknown"
