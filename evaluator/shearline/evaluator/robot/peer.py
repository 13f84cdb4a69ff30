"""The worker as the arm's process knows it: last heard when, and what it wishes.

Written by the thread that listens, read by the one that moves the arm.
"""

from __future__ import annotations

from dataclasses import dataclass

from shearline.evaluator.robot import pipe
from shearline.evaluator.robot.states import Link


class Gone:
    """The worker is not there any more."""


@dataclass(slots=True)
class Peer:
    """The worker, as last heard; written by the thread that listens."""

    linked: bool = True
    held: bool = False
    heard_s: float = 0.0
    halt_why: str = ""
    leaving: str = ""

    def link(self, now_s: float) -> Link:
        """Return whether the learner can be reached through the worker."""
        silent = now_s - self.heard_s > pipe.SILENCE_S
        return Link.LOST if silent or not self.linked else Link.UP
