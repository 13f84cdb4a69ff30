"""What tests of a robot's port share: robots by name, a tool, limits, contacts, and a way down."""

from __future__ import annotations

import importlib
import importlib.util
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from emulator import model

from shearline.evaluator.robot.port import Array, Consent, Contact, ContactSession, Guard, Tool
from shearline.sims.panda import rotation_z
from shearline.sims.scene import KEY_TURN, Q_START, TIP_M, tip_pose

OPERATOR = Consent("tests", "yes", 0.0)

#: Rotation of the key at the start, whose axes the compliance frame shares.
ROTATION = tip_pose(Q_START).rotation

STIFFNESS = np.array([1000.0, 1000.0, 1500.0, 50.0, 50.0, 50.0])


def tool() -> Tool:
    """Return the key in the hand, as the simulation has it."""
    f_t_ee = np.eye(4)
    f_t_ee[:3, :3] = rotation_z(KEY_TURN)
    f_t_ee[2, 3] = TIP_M
    return Tool(f_t_ee, 0.75, np.array([-0.01, 0.0, 0.03]))


def guard(force_n: float = 35.0, speed_mps: float = 0.3) -> Guard:
    """Return limits that a slow motion does not meet."""
    box = np.array([[0.2, -0.3, 0.05], [0.8, 0.3, 0.6]])
    return Guard(np.array([40.0] * 4 + [11.0] * 3), force_n, 5.0, speed_mps, box)


def contact(t_max_s: float, clip_m: float = 0.01) -> Contact:
    """Return a contact with critical damping in the key's frame."""
    return Contact(ROTATION, STIFFNESS, 2.0 * np.sqrt(STIFFNESS), clip_m, 0.1, t_max_s)


@dataclass(frozen=True)
class Kind:
    """One of the robots: its protocol, and what its client needs."""

    name: str
    version: int
    module: str
    port: str
    package: str

    def missing(self) -> str:
        """Say why its client cannot run on this machine, or ``""``."""
        if importlib.util.find_spec(self.package) is None:
            return f"{self.package} is not installed on this machine"
        if self.version == 5 and model.COMPILER is None:
            return "no C compiler for the library that a Panda serves"
        return ""

    def led(self, address: str) -> Any:
        """Return a port that the robot waits for; see :mod:`emulator.led`."""
        made = getattr(importlib.import_module("emulator.led"), f"Led{self.port[:-4]}")
        return made(address)

    def make(self, address: str, **options: float) -> Any:
        """Return a port; nothing is connected yet.

        A Panda's kernel timer is made patient: on a crowded machine a thread may wait for seconds.
        """
        made = getattr(importlib.import_module(self.module), self.port)
        return made(address, **({"hang_s": 10.0} | options if self.version == 5 else {}))


_ROBOT = "shearline.evaluator.robot"
FR3 = Kind("fr3", 10, f"{_ROBOT}.franky", "FrankyPort", "franky")
PANDA = Kind("panda", 5, f"{_ROBOT}.panda", "PandaPort", "panda_py")


def kinds() -> list[Any]:
    """Return both robots as parameters of a test, each skipped with its reason."""
    return [
        pytest.param(kind, id=kind.name, marks=pytest.mark.skipif(bool(why), reason=why))
        for kind in (FR3, PANDA)
        for why in [kind.missing()]
    ]


def press(port: Any, session: ContactSession, to: Array, speed_mps: float = 0.05) -> None:
    """Lead the reference to a position ``(3,)`` at a speed, in the robot's own time."""
    pose = port.sample().o_t_ee.copy()
    begin_s, begin = port.sample().t_s, pose[:3, 3].copy()
    length = float(np.linalg.norm(to - begin))
    share = 0.0
    while share < 1.0:
        share = min(1.0, (port.sample().t_s - begin_s) * speed_mps / length)
        pose[:3, 3] = begin + share * (to - begin)
        session.ref(pose)
        time.sleep(2e-3)


def wait(port: Any, for_s: float) -> None:
    """Wait for so much of the robot's time."""
    until_s = port.sample().t_s + for_s
    while port.sample().t_s < until_s:
        time.sleep(1e-3)
