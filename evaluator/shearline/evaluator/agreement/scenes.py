"""The same motion on any plant: through free space, against the face, along it, into the lock.

What is compared is what a skill would feel. Everything is in the frame of the believed lock.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shearline.evaluator.base import Array
from shearline.evaluator.keylock import BulletKeylockTask, KeylockTask
from shearline.evaluator.skill.baselines import tuple_of
from shearline.evaluator.skill.control import Feel, arm, control, empty_feel, feel
from shearline.evaluator.skill.manipulation import APPROACH_S, Command, command, empty_command
from shearline.evaluator.skill.parameters import Parameters, parameters, space
from shearline.evaluator.skill.semantic import APPROACH, SETTLE_S
from shearline.evaluator.skill.trace import COLUMNS
from shearline.sims.plant import Plant, Setup, empty_percept
from shearline.sims.scene import TICK_S, believed_lock_pose

AnyLockTask = KeylockTask | BulletKeylockTask

#: The tip meets the face of a lock that stands aside by so much [m].
ASIDE_M = 5e-3

#: Push against the face while the tip is pulled along it [N].
PRESS_N = 10.0

#: The pull grows by this much in a second [N/s], and the tip has slipped when it went so far [m].
PULL_RATE, SLIPPED_M = 0.5, 20e-6

#: Pull over push at which nobody waits for a slip any longer.
PULL_MAX = 0.4

#: Time in which the tip comes to rest on the face [s].
LANDING_S = 1.5

#: Depths at which the force of an insertion is compared: from the first pin on [m].
DEPTHS_M: Array = np.arange(5e-3, 24e-3, 0.5e-3)

_COLUMN = {name: i for i, (name, _) in enumerate(COLUMNS)}


@dataclass(frozen=True, slots=True)
class Motion:
    """What was felt in each tick: ``tip (n, 3)`` [m] and ``wrench (n, 6)`` [N, N m]."""

    tip: Array
    wrench: Array


def drive(
    plant: Plant, setup: Setup, steer: Callable[[int, Feel, Command], None], ticks: int
) -> Motion:
    """Move the arm under the skill's controller.

    Args:
        plant: Is reset first.
        setup: Where the lock stands.
        steer: Given tick, feeling and the last command, changes the command.
        ticks: For how long.
    """
    percept, f, c = empty_percept(), empty_feel(), empty_command()
    panda = arm(believed_lock_pose(), TICK_S)
    tip, wrench = np.empty((ticks, 3)), np.empty((ticks, 6))
    plant.reset(setup)
    for tick in range(ticks):
        plant.sense(percept)
        if tick == 0:
            f.tau[:] = percept.bias
        feel(f, percept, panda)
        tip[tick], wrench[tick] = f.tip, f.wrench
        steer(tick, f, c)
        control(f, percept, c, panda)
        plant.step(f.tau)
    return Motion(tip, wrench)


def through_free_space(plant: Plant, seed: int) -> Array:
    """Approach as a random tuple says, then swing on soft springs; return the tip ``(n, 3)`` [m].

    The lock is out of reach.
    """
    p = parameters(space().denormalise(np.random.default_rng(seed).uniform(size=len(space()))))
    away = Setup(lock=believed_lock_pose().moved(np.array([0.0, 0.0, 0.2]), np.zeros(3)))
    arrived = round((APPROACH_S + SETTLE_S) / TICK_S)
    return drive(plant, away, lambda *now: _approach_and_swing(p, arrived, *now), 2 * arrived).tip


def _approach_and_swing(p: Parameters, arrived: int, tick: int, f: Feel, c: Command) -> None:
    if tick < arrived:
        command(c, APPROACH, tick, f.tip, f.speed[2], p, TICK_S)
        return
    c.v[:] = 0.0
    c.w[:] = 0.0
    c.stiffness[:3] = 500.0
    c.wrench[0] = p.wig_a_x * math.sin(2.0 * math.pi * p.wig_f_x * (tick - arrived) * TICK_S)
    c.wrench[1] = p.wig_a_y * math.sin(2.0 * math.pi * p.wig_f_y * (tick - arrived) * TICK_S)


def against_the_face(plant: Plant, push_n: float) -> float:
    """Push on the face of the lock; return the force that comes back at rest [N]."""
    ticks = round(LANDING_S / TICK_S)
    felt = drive(plant, _aside(), lambda _, _f, c: _press(c, push_n), ticks)
    return -float(felt.wrench[-100:, 2].mean())


def along_the_face(plant: Plant, direction_rad: float) -> tuple[float, Array]:
    """Press, then pull the tip along the face ever harder until it slips.

    Args:
        plant: Is reset first.
        direction_rad: Of the pull, from x towards y.

    Returns:
        The pull at which it slips over the push, and how far it has moved over time
        ``(n, 2)``: pull over push, [m].
    """
    pull = np.array([math.cos(direction_rad), math.sin(direction_rad)])
    landed = round(LANDING_S / TICK_S)
    ticks = landed + round(PULL_MAX * PRESS_N / PULL_RATE / TICK_S)

    def steer(tick: int, _: Feel, c: Command) -> None:
        _press(c, PRESS_N)
        if tick >= landed:
            c.stiffness[:2] = 0.0
            c.drag[:2] = 10.0
            c.wrench[:2] = PULL_RATE * (tick - landed) * TICK_S * pull

    tip = drive(plant, _aside(), steer, ticks).tip[landed:]
    moved = (tip[:, :2] - tip[0, :2]) @ pull
    share = PULL_RATE * np.arange(len(moved)) * TICK_S / PRESS_N
    slipped = np.flatnonzero(moved > SLIPPED_M)
    onset = float(share[slipped[0]]) if slipped.size else math.inf
    return onset, np.stack([share, moved], axis=1)


def into_the_lock(task: AnyLockTask) -> Array:
    """Move the key in slowly and straight; return the force of the lock at :data:`DEPTHS_M` [N].

    The skill's contact phase does it: it seeks a force of 12 N, which the pins alone never give.
    """
    slow = {"con_speed": 0.02, "con_force": 12.0, "con_k_xy": 2000.0, "ins_k_rot": 200.0}
    job = task.job(tuple_of(slow | dict.fromkeys(("app_off_x", "app_off_y"), 0.0)))
    _, rows = task.execute(Setup(), job, lambda: None)
    depth, force = rows[:, _COLUMN["depth"]], -rows[:, _COLUMN["wrench.fz"]]
    edges = np.append(DEPTHS_M, 2.0 * DEPTHS_M[-1] - DEPTHS_M[-2])
    where = np.digitize(depth, edges) - 1
    return np.array([force[where == i].mean() for i in range(len(DEPTHS_M))])


def verdict(task: AnyLockTask, seed: int) -> tuple[bool, float]:
    """Try the random tuple of a seed; return success and cost."""
    theta = space().denormalise(np.random.default_rng(seed).uniform(size=len(space())))
    outcome = task.run(theta, seed, lambda: None)
    return outcome.success, outcome.cost


def _aside() -> Setup:
    return Setup(lock=believed_lock_pose().moved(np.array([-ASIDE_M, 0.0, 0.0]), np.zeros(3)))


def _press(c: Command, push_n: float) -> None:
    """Hold all but the axis, along which a force acts; brake, so that it lands softly."""
    c.stiffness[:] = (2000.0, 2000.0, 0.0, 200.0, 200.0, 200.0)
    c.ratio[0] = 1.0
    c.drag[2] = 200.0
    c.wrench[2] = push_n
