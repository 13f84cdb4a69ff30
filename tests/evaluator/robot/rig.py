"""A stage in this process, and an arm on it: what the robot's tests share."""

from __future__ import annotations

import io
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import msgspec
import numpy as np

from shearline.evaluator.keylock_spec import keylock_spec
from shearline.evaluator.robot import pipe
from shearline.evaluator.robot.arm import Arm
from shearline.evaluator.robot.bounds import Bounds, read_bounds
from shearline.evaluator.robot.load import load_port
from shearline.evaluator.robot.port import Array, RobotPort
from shearline.evaluator.robot.results import Task
from shearline.evaluator.robot.states import State
from shearline.evaluator.robot.store import Store
from shearline.evaluator.robot.terminal import Line, Terminal
from shearline.protocol.messages import Trial

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
LAB = (EXAMPLES / "stage.toml").read_text()
SPACE = keylock_spec().space

#: The stage's hole in its base frame: z points down into it.
O_T_LOCK = np.array(
    [[1.0, 0.0, 0.0, 0.3], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.1], [0.0, 0.0, 0.0, 1.0]]
)


def stage(hand: str = "") -> Any:
    """Return the example's stage."""
    return load_port(f"{EXAMPLES / 'stage.py'}:Stage", hand)


def bounds(**changes: object) -> Bounds:
    """Return the stage's bounds, with whole tables replaced."""
    lab = read_bounds(EXAMPLES / "stage.toml")
    brisk = msgspec.structs.replace(lab.start, speed_mps=0.25)
    return msgspec.structs.replace(lab, **({"start": brisk} | changes))


def theta(**changes: float) -> list[float]:
    """Return the stage's canary, changed: a tuple that succeeds."""
    named = dict(zip(SPACE, bounds().canary_tuple().tolist(), strict=True))
    return list((named | changes).values())


def attempt(number: int = 0, **changes: Any) -> pipe.Try:
    """Return an attempt as the worker hands it on."""
    facts: dict[str, Any] = {
        "boot": "boot-0001",
        "epoch": 1,
        "trial": number,
        "episode": 0,
        "attempt": 1,
        "token": f"token-{number:06}",
        "theta": theta(),
        "seed": number,
        "lease_s": 2.0,
        "deadline_s": 60.0,
    }
    return pipe.Try(run="run-1", trial=Trial(**(facts | changes)))


def typed(word: str) -> Line:
    """Return a line that is typed just now."""
    return Line(word, time.monotonic())


def answering(word: str) -> Line:
    """Return a line that will have been typed after whatever is asked next."""
    return Line(word, math.inf)


class Spy:
    """Passes everything on to a stage and counts what moves it; may interfere."""

    def __init__(self, interfere: Callable[[Any, str], None] = lambda _stage, _what: None) -> None:
        self.stage = stage()
        self.moves: list[str] = []
        self.interfere = interfere

    def __getattr__(self, name: str) -> Any:
        if name in {"move_free", "contact", "ref"}:
            return lambda *args: self._move(name, *args)
        return getattr(self.stage, name)

    def _move(self, name: str, *args: Any) -> Any:
        self.moves.append(name)
        self.interfere(self.stage, name)
        made = getattr(self.stage, name)(*args)
        return self if name == "contact" else made


def lying(**lies: Any) -> Any:
    """Return a stage whose samples can be made to lie: ``.lies`` replaces fields."""
    port = stage()
    true = port.sample
    port.lies = dict(lies)
    port.sample = lambda: true()._replace(**port.lies)
    return port


@dataclass
class Rig:
    """An arm on a port, driven step by step: the loop of its process without the process."""

    port: RobotPort
    store: Store
    lab: Bounds
    o_t_lock: Array = field(default_factory=lambda: O_T_LOCK)
    step: bool = False

    def __post_init__(self) -> None:
        self.said: list[pipe.Say] = []
        self.heard = io.StringIO()
        self.inbox: SimpleQueue[Any] = SimpleQueue()
        self.terminal = Terminal(self.inbox, self.port.stop, io.StringIO(), self.heard)
        self.arm = Arm(
            port=self.port,
            bounds=self.lab,
            store=self.store,
            task=Task(),
            terminal=self.terminal,
            say=self.said.append,
            o_t_lock=self.o_t_lock,
            step=self.step,
        )
        self.arm.begin()

    @property
    def state(self) -> State:
        return self.arm.state

    @property
    def printed(self) -> str:
        return self.heard.getvalue()

    def type(self, *words: str) -> pipe.Over | None:
        """Have the operator type, and the arm act on it."""
        over = None
        for word in words:
            over = self.arm.handle(typed(word))
        return over

    def tick(self) -> None:
        """Let the arm look at the robot once."""
        self.arm.handle(None)

    def armed(self) -> Rig:
        """Confirm and rehearse."""
        self.type("confirm")
        assert self.state is State.READY, self.printed
        return self

    def run(self, asked: pipe.Try) -> pipe.Answer:
        """Have an attempt run, and return the answer."""
        self.arm.handle(asked)
        answers = [said for said in self.said if isinstance(said, pipe.Answer)]
        return answers[-1]

    def takes(self) -> bool:
        """Whether the worker was told that trials may come."""
        return [said.takes for said in self.said if isinstance(said, pipe.Stands)][-1]

    def armed_or_not(self) -> Rig:
        """Confirm, whatever comes of it."""
        self.type("confirm")
        return self
