"""A client library without a robot: it does what it is told, and lies when it is told to."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np

from shearline.evaluator.robot.client import JOINTS, Drive, row_of
from shearline.evaluator.robot.errors import MotionEnded
from shearline.evaluator.robot.franka import Franka
from shearline.evaluator.robot.port import Array, Clip, Contact, Guard, Mode, Tool


class Clockwork:
    """A :class:`~shearline.evaluator.robot.client.Client`; a state takes 1 ms of its own time.

    Attributes:
        felt: What it says of ``tau_ext`` and wrench, signs as the robot has them ``(13,)``.
        pose: Where the tip is; it jumps to whatever is aimed at.
        aims: All that was aimed at.
        drives: All that was begun.
        deaf: So many brakes are not heard, and for so long it does not say that it runs.
        lie: Changes each pose before it is told.
    """

    turning = 1.0

    def __init__(self) -> None:
        self.felt, self.pose = np.full(13, 0.1), np.eye(4)
        self.aims: list[Array] = []
        self.drives: list[Drive] = []
        self.deaf = 0
        self.braked = threading.Event()
        self.lie: Callable[[Array], Array] = lambda pose: pose
        self._t_s, self._runs = 0.0, False

    def connect(self, address: str) -> str:
        return f"clockwork {address}"

    def disconnect(self) -> None:
        self._runs = False

    def set_tool(self, tool: Tool) -> None: ...
    def set_limits(self, tau: Array, force: Array) -> None: ...
    def recover(self) -> None: ...

    def read(self) -> tuple[Array, Mode, tuple[str, ...]]:
        return self._row(), Mode.IDLE, ()

    def clip(self, contact: Contact) -> Clip:
        return Clip(contact.o_r_c, contact.clip_m, contact.clip_rad)

    def begin(self, drive: Drive) -> None:
        self.drives.append(drive)
        self._runs = True

    def aim(self, pose: Array) -> None:
        self.aims.append(pose)
        self.pose = pose

    def tune(self, stiffness: Array, damping: Array) -> None:
        pass

    def newest(self) -> Array | None:
        return self._row() if self._runs else None

    def running(self) -> bool:
        return self._runs and self.deaf == 0

    def finish(self) -> None:
        self._runs = False

    def brake(self) -> None:
        if self.deaf > 0:
            self.deaf -= 1
        else:
            self._runs = False
            self.braked.set()

    def outcome(self) -> MotionEnded | None:
        self._runs = False
        return None

    def rows(self) -> list[Array]:
        return []

    def _row(self) -> Array:
        self._t_s += 1e-3
        still = np.zeros(JOINTS)
        told = self.lie(self.pose)
        return row_of(self._t_s, still, still, still, self.felt[:JOINTS], told, self.felt[JOINTS:])


def limits(push_max_n: float = 40.0, twist_max_nm: float = 12.0) -> Guard:
    """Return wide limits."""
    box = np.array([[-1.0] * 3, [1.0] * 3])
    return Guard(np.full(JOINTS, 40.0), 60.0, 15.0, 0.25, box, push_max_n, twist_max_nm)


def port(client: Clockwork) -> Franka:
    """Return a port that is open, guarded and tared."""
    made = Franka(client, "here")
    made.open(Tool(np.eye(4), 0.5, np.zeros(3)))
    made.set_guard(limits())
    return made
