"""What the worker and the arm's process say to each other: typed messages over one local pipe.

The worker is on the network and the arm's process is not; so this list is all that a network can
ever ask of the arm. There is no message that arms it, recovers it, or changes a limit, and what
is malformed ends the conversation, which the arm takes as the loss of its link.
"""

from __future__ import annotations

import os
import select
import struct
from typing import Annotated

import msgspec
from msgspec import Meta

from shearline.protocol.messages import Result, TraceData, Trial

#: A trace of 60 s at 1 kHz with 60 columns takes 15 MB.
BYTES_MAX = 32 * 1024 * 1024

#: Without a sign of life for so long the other side is frozen [s].
SILENCE_S = 1.0

#: A sign of life is given so often [s].
PULSE_S = 0.1


class Say(msgspec.Struct, frozen=True, kw_only=True, tag_field="say"):
    """Base of all that is said on the pipe."""


# -- to the arm ----------------------------------------------------------------------------------


class Try(Say, frozen=True, kw_only=True, tag="try"):
    """Run this attempt of this run."""

    run: str
    trial: Trial


class Stop(Say, frozen=True, kw_only=True, tag="stop"):
    """End the trial of this attempt without a verdict and bring the key out."""

    token: str
    why: str


class Look(Say, frozen=True, kw_only=True, tag="look"):
    """A sign of life: whether the learner can be reached, and whether it holds the run."""

    linked: bool
    held: bool


class Leave(Say, frozen=True, kw_only=True, tag="leave"):
    """No more trials; bring the key out and end."""

    why: str


ToArm = Try | Stop | Look | Leave

# -- from the arm --------------------------------------------------------------------------------


class Pulse(Say, frozen=True, kw_only=True, tag="pulse"):
    """A sign of life of the thread that moves the arm."""


class Stands(Say, frozen=True, kw_only=True, tag="stands"):
    """Where the arm stands now, what the operator is told about it, and whether trials may come."""

    state: Annotated[str, Meta(max_length=32)]
    why: str = ""
    engine: str = ""
    takes: bool = False


class Answer(Say, frozen=True, kw_only=True, tag="answer"):
    """How an attempt ended; it is in the spool already."""

    result: Result
    trace: TraceData | None = None


class Over(Say, frozen=True, kw_only=True, tag="over"):
    """The arm's process ends: an exit code and one sentence."""

    code: int
    why: str


FromArm = Pulse | Stands | Answer | Over

_HEAD = struct.Struct("!I")


class Pipe:
    """One end: whole messages over two file descriptors.

    Args:
        read: To read from.
        write: To write to.
    """

    def __init__(self, read: int, write: int) -> None:
        self.read = read
        self._write = write
        os.set_blocking(read, True)

    def send(self, message: Say) -> None:
        """Say something.

        Raises:
            OSError: If the other end is closed.
        """
        data = msgspec.msgpack.encode(message)
        view = memoryview(_HEAD.pack(len(data)) + data)
        while view:
            view = view[os.write(self._write, view) :]

    def receive(self, timeout_s: float | None = None) -> bytes | None:
        """Return the next message's bytes, ``None`` if none began within ``timeout_s``.

        Raises:
            EOFError: If the other end is closed, or what comes is no message.
        """
        if timeout_s is not None and not select.select([self.read], [], [], timeout_s)[0]:
            return None
        (size,) = _HEAD.unpack(self._exactly(_HEAD.size))
        if size > BYTES_MAX:
            raise EOFError
        return self._exactly(size)

    def close(self) -> None:
        """Close both directions."""
        for handle in {self.read, self._write}:
            os.close(handle)

    def _exactly(self, size: int) -> bytes:
        data = bytearray()
        while len(data) < size:
            more = os.read(self.read, min(size - len(data), 1 << 20))
            if not more:
                raise EOFError
            data += more
        return bytes(data)
