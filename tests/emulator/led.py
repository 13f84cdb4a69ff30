"""The ports of both robots with Python in the lockstep too: the robot waits for who looks at it.

In a plain lockstep the robot waits for its client's C++ alone, and on a crowded machine Python may
find that half a second has passed. Here the robot goes on by 5 ms at each look, so that a trial
runs the same on any machine. Not for tests of a hung Python.
"""

from __future__ import annotations

import contextlib
import socket
from typing import Any

import numpy as np
from emulator.server import LEAD

from shearline.evaluator.robot.errors import MotionEnded
from shearline.evaluator.robot.franka import Franka
from shearline.evaluator.robot.franky import FrankyClient
from shearline.evaluator.robot.panda import PandaClient
from shearline.evaluator.robot.port import Sample


class Led(Franka):
    """A Franka whose robot waits for each :meth:`sample`."""

    def __init__(self, client: Any, address: str) -> None:
        super().__init__(client, address)
        self._where = (address, LEAD)
        self._lead: socket.socket | None = None
        self._seen_ms = -1

    def sample(self) -> Sample:
        """Look, and let the robot go on."""
        sample = super().sample()
        self._say(round(1000.0 * sample.t_s) if np.isfinite(sample.t_s) else 0)
        return sample

    def ended(self) -> MotionEnded | None:
        """Let the robot go, and wait for the end of the motion."""
        self._say(0)
        return super().ended()

    def close(self) -> None:
        """Let the robot go, and close."""
        self._say(0)
        super().close()
        if self._lead is not None:
            self._lead.close()
            self._lead = None

    def _say(self, seen_ms: int) -> None:
        if seen_ms == self._seen_ms:
            return
        self._seen_ms = seen_ms
        if self._lead is None:
            self._lead = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._lead.connect(self._where)
        with contextlib.suppress(ConnectionRefusedError):  # the robot has gone
            self._lead.send(str(seen_ms).encode())


class LedFranky(Led):
    """An FR3."""

    def __init__(self, address: str) -> None:
        super().__init__(FrankyClient(), address)


class LedPanda(Led):
    """A Panda."""

    def __init__(self, address: str) -> None:
        super().__init__(PandaClient(hang_s=10.0), address)
