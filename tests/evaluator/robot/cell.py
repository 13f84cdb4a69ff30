"""A whole robot cell without the network: robot, folder, arm's process, terminal, worker's side."""

from __future__ import annotations

import os
import subprocess
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import msgspec
import numpy as np
from emulator.kit import Kind
from emulator.process import Emulator
from evaluator.robot.rig import EXAMPLES, O_T_LOCK, attempt

from shearline.evaluator.base import Outcome, TrialAborted, TrialRejected
from shearline.evaluator.robot.bounds import Bounds, read_bounds
from shearline.evaluator.robot.process import Orders
from shearline.evaluator.robot.store import Calibration
from shearline.evaluator.robot.task import RobotTask
from shearline.protocol.messages import Result
from shearline.sims.scene import KEY_TURN, TIP_M, believed_lock_pose

WAIT_S = 60.0

#: The example's canary, which opens the emulated lock through both clients.
CANARY = "\n".join(
    f"{name} = {value!r}" for name, value in read_bounds(EXAMPLES / "lab.toml").canary.theta.items()
)

#: The lab of the emulated Frankas; the key as the simulation has it.
FRANKA_LAB = f"""
[tool]
flange_to_tip_m = [0.0, 0.0, {TIP_M!r}]
flange_to_tip_rad = [0.0, 0.0, {KEY_TURN!r}]
mass_kg = 0.75
centre_m = [-0.01, 0.0, 0.03]
[guard]
tau_ext_nm = [40.0, 40.0, 40.0, 40.0, 11.9, 11.9, 11.9]
lowest_m = [0.2, -0.3, 0.05]
highest_m = [0.8, 0.3, 0.6]
[canary.theta]
{CANARY}
"""


def believed() -> np.ndarray:
    """Return where the emulated lock is believed to be ``(4, 4)``."""
    pose, made = believed_lock_pose(), np.eye(4)
    made[:3, :3], made[:3, 3] = pose.rotation, pose.position
    return made


def calibrate(folder: Path, o_t_lock: np.ndarray, lab: Bounds) -> None:
    """Write what the operator's hand would have shown."""
    shown = Calibration(
        o_t_lock=tuple(o_t_lock.ravel().tolist()),
        spread_m=0.0,
        spread_rad=0.0,
        repeats=5,
        at="",
        tool=lab.tool,
        seated_m=lab.lock.seated_m,
    )
    folder.mkdir(exist_ok=True)
    (folder / "calibration.json").write_bytes(msgspec.json.encode(shown))


@dataclass
class Cell:
    """One robot with its folder; processes come and go.

    Args:
        folder: Where the lab's file and the robot's folder are.
        kind: A Franka through its real client, or ``None`` for the example's stage.
        robot: Its emulator.
    """

    folder: Path
    kind: Kind | None = None
    robot: Emulator | None = None
    lab: str = ""
    said: list[tuple[int, str]] = field(default_factory=list)
    ready: threading.Event = field(default_factory=threading.Event)
    linked: bool = True

    def __post_init__(self) -> None:
        stage = (EXAMPLES / "stage.toml").read_text()
        path = self.folder / "lab.toml"
        path.write_text(self.lab + (stage if self.kind is None else FRANKA_LAB))
        o_t_lock = O_T_LOCK if self.kind is None else believed()
        calibrate(self.state, o_t_lock, read_bounds(path))

    @property
    def state(self) -> Path:
        return self.folder / "lab.state"

    def orders(self, **changes: Any) -> Orders:
        own = {"robot": f"{EXAMPLES / 'stage.py'}:Stage"}
        if self.kind is not None:
            assert self.robot is not None
            name = "franka" if self.kind.version == 10 else "panda"
            own = {"robot": name, "address": self.robot.address}
        return Orders(**({"bounds": str(self.folder / "lab.toml")} | own | changes))

    def __enter__(self) -> Self:
        reads, self._types = os.pipe()
        self.task = RobotTask(self.orders(), reads)
        self.task.join("lab-1", self._ready, lambda *over: self.said.append(over), self._look)
        try:
            self.task.warm()
        finally:
            os.close(reads)
        return self

    def __exit__(self, *_: object) -> None:
        self.task.close()
        os.close(self._types)
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()

    @property
    def process(self) -> subprocess.Popen[bytes]:
        assert self.task._process is not None
        return self.task._process

    def type(self, *words: str) -> None:
        """Have the operator type at the robot's terminal."""
        os.write(self._types, "".join(f"{word}\n" for word in words).encode())

    def armed(self) -> Self:
        """Confirm, and wait until the arm takes trials."""
        self.type("confirm")
        assert self.ready.wait(WAIT_S), self.diary()
        return self

    def start(self, number: int = 0, **changes: Any) -> Running:
        """Have an attempt run on a thread of its own."""
        return Running(self, attempt(number, **({"theta": self.theta()} | changes)))

    def theta(self, **changes: float) -> list[float]:
        """Return a tuple that succeeds on this robot, changed."""
        from shearline.evaluator.robot.bounds import read_bounds  # noqa: PLC0415 - after the file
        from shearline.evaluator.skill.parameters import BOUNDS  # noqa: PLC0415

        canary = read_bounds(self.folder / "lab.toml").canary_tuple().tolist()
        return list((dict(zip(BOUNDS, canary, strict=True)) | changes).values())

    def until(self, holds: Any, what: str) -> None:
        """Wait until something holds."""
        end_s = time.monotonic() + WAIT_S
        while not holds():
            assert time.monotonic() < end_s, f"{what} never came: {self.diary()}"
            time.sleep(0.005)

    def in_contact(self) -> bool:
        """Whether the key may be in the lock."""
        return (self.state / "key-in-lock").exists()

    def stands(self) -> str:
        """Return the arm's state as the diary has it."""
        found = [line for line in self.diary().splitlines() if '"what": "state"' in line]
        return str(msgspec.json.decode(found[-1])["after"]) if found else ""

    def diary(self) -> str:
        path = self.state / "diary.jsonl"
        return path.read_text() if path.exists() else ""

    def spooled(self) -> list[Result]:
        return self.task.spool.pending("run-1")

    def moves(self) -> int:
        """Return how many motions the robot has begun, as the robot counts them."""
        if self.robot is not None:
            return int(self.robot.report()["moves"])
        return self.diary().count('"after": "approach"')

    def _ready(self, ready: bool) -> None:  # noqa: FBT001 - as the worker is told
        (self.ready.set if ready else self.ready.clear)()

    def _look(self) -> tuple[bool, bool]:
        return self.linked, False


class Running:
    """An attempt that runs: how it ended, or how it will."""

    def __init__(self, cell: Cell, asked: Any) -> None:
        self.ended: Outcome | TrialAborted | None = None
        self._cell, self._asked = cell, asked
        self._stop_why = ""
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        task = self._cell.task
        task.announce(self._asked.run, self._asked.trial)
        try:
            self.ended = task.run(np.array(self._asked.trial.theta), 0, self._beat)
        except TrialAborted as aborted:
            self.ended = aborted

    def _beat(self) -> None:
        if self._stop_why:
            raise TrialAborted(self._stop_why)

    def stop(self, why: str) -> None:
        """Have the worker's next beat end it."""
        self._stop_why = why

    def outcome(self) -> Outcome:
        """Return the verdict."""
        ended = self.end()
        assert isinstance(ended, Outcome), f"{ended}\n{self._cell.diary()}"
        return ended

    def aborted(self) -> str:
        """Return why there is no verdict."""
        ended = self.end()
        assert isinstance(ended, TrialAborted), ended
        assert not isinstance(ended, TrialRejected), ended
        return str(ended)

    def rejected(self) -> str:
        """Return why it was not begun."""
        ended = self.end()
        assert isinstance(ended, TrialRejected), ended
        return str(ended)

    def end(self) -> Outcome | TrialAborted | None:
        self._thread.join(WAIT_S)
        assert not self._thread.is_alive(), self._cell.diary()
        return self.ended
