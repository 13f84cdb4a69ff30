"""The worker as the arm's process knows it: last heard when, and what it wishes.

Written by the thread that listens, read by the one that moves the arm.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from shearline.evaluator.robot import pipe
from shearline.evaluator.robot.states import Link


class Gone:
    """The worker is not there any more."""


@dataclass(slots=True)
class Peer:
    """The worker, as last heard; written by the thread that listens.

    Attributes:
        halts: Token of each attempt that is to end, and why.
        running: Token of the attempt that runs; written by the thread that moves the arm.
    """

    linked: bool = True
    held: bool = False
    heard_s: float = 0.0
    halts: dict[str, str] = field(default_factory=dict)
    running: str = ""
    leaving: str = ""

    @property
    def halt_why(self) -> str:
        """Why the attempt that runs is to end, or ``""``."""
        return self.halts.get(self.running, "")

    def link(self, now_s: float) -> Link:
        """Return whether the learner can be reached through the worker."""
        silent = now_s - self.heard_s > pipe.SILENCE_S
        return Link.LOST if silent or not self.linked else Link.UP
