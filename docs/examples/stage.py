"""A robot of one's own: three axes that hold a peg over a hole, simulated a millisecond a sample.

`Slide` stands for the hardware and its driver; `Stage` is all that one writes to attach it.
"""

from dataclasses import replace

import numpy as np

from shearline.evaluator.robot.errors import Ending, MotionEnded, RobotRefused
from shearline.evaluator.robot.frames import pose
from shearline.evaluator.robot.port import (
    TARE_SHARE,
    Consent,
    Contact,
    Guard,
    Mode,
    Sample,
    Tool,
    log_row,
)

DOWN, MOUTH, HOLE = np.diag([1.0, -1.0, -1.0]), np.array([0.3, 0.0, 0.1]), (0.2e-3, -0.1e-3)
DEPTH, CLEARANCE, WALL, MASS, TICK = 0.025, 0.4e-3, 5e4, 5.0, 1e-3


class Slide:
    """Three sliding axes, the peg they hold, and the hole: where it is, how fast, what it feels."""

    def __init__(self, height_m: float) -> None:
        self.x, self.v, self.force = MOUTH - DOWN[2] * height_m, np.zeros(3), np.zeros(3)
        self.zero, self.rng = np.zeros(3), np.random.default_rng(0)

    def step(self, c: Contact | None, goal: np.ndarray) -> None:
        """Move on by one tick of impedance control, or stand still."""
        if c is not None:
            k = c.stiffness[:3]
            pull = k * np.clip(c.o_r_c.T @ (goal - self.x), -c.clip_m, c.clip_m)
            brake = c.damping[:3] * (c.o_r_c.T @ self.v)
            self.v = self.v + TICK / MASS * (c.o_r_c @ (pull - brake) + self.force)
            self.x = self.x + TICK * self.v
        self.force = DOWN @ self.resistance(DOWN @ (self.x - MOUTH), DOWN @ self.v)

    def feel(self) -> np.ndarray:
        """Return what the sensor reads, not tared."""
        return self.force + self.rng.normal(0.0, 0.01, 3)

    def resting(self, guard: Guard) -> np.ndarray:
        """Return what a tare would take for nothing, unless it is too much to be that."""
        felt = self.feel()
        if np.linalg.norm(felt) > TARE_SHARE * guard.force_max_n:
            raise RobotRefused(f"{felt.round(1)} N on the peg: free it before it is tared")
        return felt

    def resistance(self, at: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Return the force on the peg in the frame of the mouth: face, wall, friction, bottom."""
        off = at[:2] - HOLE
        far = np.linalg.norm(off) - CLEARANCE
        if at[2] <= 0.0 or far > at[2]:  # in the air, or on the face around the hole
            return np.array([0.0, 0.0, -WALL * max(at[2], 0.0) - 80.0 * speed[2] * (at[2] > 0.0)])
        wall = -WALL * max(far, 0.0) * off / max(np.linalg.norm(off), 1e-9)
        return np.array([*wall, -4.0 * np.tanh(speed[2] / 2e-3) - WALL * max(at[2] - DEPTH, 0.0)])


class Stage:
    """The slide as a robot; it never turns. ``Stage("hand")`` is held in the hole by a hand."""

    joints, engine = 3, "stage 1"

    def __init__(self, hand: str = "") -> None:
        self.hand, self.slide = hand, Slide(-DEPTH if hand else 0.02)
        self.latch = RobotRefused("no guard is set: set_guard() comes first")
        self.t_s, self.rows, self.guard, self.task, self.goal = 0.0, [], None, None, None

    def open(self, tool: Tool) -> None: ...
    def close(self) -> None: ...
    def set_guard(self, guard: Guard, *, tare: bool = True) -> None:
        self.slide.zero = self.slide.resting(guard) if tare else self.slide.zero
        self.latch, self.guard = self.latch if self.guard else None, guard

    def sample(self) -> Sample:
        self.t_s += TICK
        self.slide.step(self.task, self.goal)
        felt, x = self.slide.feel() - self.slide.zero, self.slide.x
        if self.task and self.t_s >= self.until:
            self._end(Ending.TIME, "the contact's time is up")
        elif self.task and np.linalg.norm(felt) > self.guard.force_max_n:
            self._end(Ending.GUARD, "the force is above the guard's")
        at = pose(x + self.slide.rng.normal(0.0, 2e-5, 3) if self.hand else x, DOWN)
        mode, wrench = Mode.MOVE if self.task else Mode.IDLE, np.append(felt, [0.0] * 3)
        now = Sample(self.t_s, x, self.slide.v, -felt, felt, at, wrench, mode)
        self.rows.append(log_row(now))
        return now

    def move_free(self, o_t_ee: np.ndarray, speed_mps: float) -> None:
        start, goal = self.slide.x, o_t_ee[:3, 3]
        steps = max(1, int(np.linalg.norm(goal - start) / speed_mps / TICK * 1.875))
        for u in np.arange(0, steps + 1) / steps:  # minimum jerk: at most 1.875 times the mean
            self._check(goal)
            self.slide.x = start + (goal - start) * u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
            self.sample()

    def contact(self, contact: Contact) -> "Stage":
        self._check(self.slide.x)
        self.task, self.goal, self.ended = contact, self.slide.x, None
        self.slide.v, self.until = np.zeros(3), self.t_s + contact.t_max_s
        return self

    def ref(self, o_t_ee: np.ndarray) -> None:
        self.goal = o_t_ee[:3, 3]
        if self.ended:
            raise self.ended

    def gains(self, stiffness: np.ndarray, damping: np.ndarray) -> None:
        self.task = self.task and replace(self.task, stiffness=stiffness, damping=damping)

    def end(self) -> None:
        self.task = None
        self.ref(pose(self.slide.x, DOWN))  # raises if it had ended before

    def stop(self) -> None:
        self.latch = self.ended = MotionEnded(Ending.STOPPED, "the arm was stopped")
        self.task = None

    def recover(self, consent: Consent) -> None:
        self.latch = None

    def drain_log(self) -> np.ndarray:
        rows, self.rows = self.rows, []
        return np.array(rows).reshape(-1, 35)

    def _check(self, goal: np.ndarray) -> None:
        if self.latch or (goal < self.guard.box_m[0]).any() or (goal > self.guard.box_m[1]).any():
            raise self.latch or MotionEnded(Ending.GUARD, "the goal is outside the workspace")

    def _end(self, ending: Ending, what: str) -> None:
        self.task, self.ended = None, MotionEnded(ending, what)
