"""One trial of the skill on any plant, as a closed loop that goes through Python in every tick.

What MuJoCo runs instead is the same loop, compiled: :mod:`shearline.evaluator.skill.loop`. Both
write the same rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from shearline.evaluator.base import TrialAborted
from shearline.evaluator.skill.control import Arm
from shearline.evaluator.skill.manipulation import APPROACH_S
from shearline.evaluator.skill.parameters import Parameters
from shearline.evaluator.skill.semantic import (
    END,
    EXTRACTION_MAX_S,
    OPEN,
    SEARCH_MAX_S,
    SETTLE_S,
    TIME_MAX_S,
    Decision,
    Limits,
    beginning,
    may_start,
)
from shearline.evaluator.skill.skill import State, empty_state, tick
from shearline.evaluator.skill.trace import COLUMNS, write_row
from shearline.sims.compiled import compiled
from shearline.sims.panda import JOINTS, Array
from shearline.sims.plant import Percept, Plant, Setup
from shearline.sims.scene import TICK_S

#: No trial is longer than all its phases together [s].
TRIAL_MAX_S = APPROACH_S + SETTLE_S + SEARCH_MAX_S + TIME_MAX_S + EXTRACTION_MAX_S + 0.1

TICKS_MAX = round(TRIAL_MAX_S / TICK_S)

#: Ticks between two heart beats: at most .1 s of wall time in the slowest of plants.
BEAT_TICKS = 100


class Job(NamedTuple):
    """What one trial is to do.

    Attributes:
        p: The tuple being tried.
        limits: What the trial must not exceed.
        arm: Constants of the arm and the believed pose of the lock.
        extract: Whether to pull the key out after the verdict.
    """

    p: Parameters
    limits: Limits
    arm: Arm
    extract: bool


def execute(
    plant: Plant, setup: Setup, job: Job, beat: Callable[[], None], rows: Array | None = None
) -> tuple[Decision, Array]:
    """Run one trial tick by tick.

    Args:
        plant: Is reset first.
        setup: What differs in this trial.
        job: What to do.
        beat: Called every :data:`BEAT_TICKS`; what it raises ends the trial.
        rows: Buffer ``(TICKS_MAX, columns)`` to write into, or ``None`` for a new one.

    Returns:
        How it ended, and the rows ``(ticks, columns)`` of the trace (a view of the buffer).

    Raises:
        TrialAborted: If the preconditions do not hold or no verdict was reached.
        PlantError: If the simulation is no longer physical.
    """
    rows = np.empty((TICKS_MAX, len(COLUMNS))) if rows is None else rows
    state, now, done, noise = begin(plant, setup, job), beginning(), 0, noise_of(setup)
    while not finished(now, extract=job.extract):
        if done >= TICKS_MAX:
            raise TrialAborted(f"no verdict after {TRIAL_MAX_S:.1f} s: the skill does not end")
        plant.sense(state.percept)
        now = tick_and_write(state, now, job, noise, rows, done)
        plant.step(state.feel.tau)
        done += 1
        if done % BEAT_TICKS == 0:
            beat()
    return now, rows[:done]


def noise_of(setup: Setup) -> Array:
    """Return what the torque sensors add in each tick ``(ticks, 7)`` [N m]; no rows: nothing."""
    return np.empty((0, JOINTS)) if setup.noise is None else setup.noise.samples(TICKS_MAX)


@compiled
def disturb(percept: Percept, noise: Array, tick: int) -> None:
    """Add the sensors' error of one tick to the contact torques, if there is any."""
    if tick < noise.shape[0]:
        for j in range(JOINTS):
            percept.contact[j] += noise[tick, j]


@compiled
def tick_and_write(
    state: State, now: Decision, job: Job, noise: Array, rows: Array, done: int
) -> Decision:
    """Run the skill's layers once and write row ``done``; return where the skill stands."""
    disturb(state.percept, noise, done)
    now = tick(state, now, job.p, job.limits, job.arm, TICK_S)
    write_row(rows[done], state, now)
    return now


def begin(plant: Plant, setup: Setup, job: Job) -> State:
    """Reset the plant and check the preconditions."""
    plant.reset(setup)
    state = empty_state()
    plant.sense(state.percept)
    x, y, depth = (float(value) for value in state.percept.in_lock)
    if not may_start(depth, math.hypot(x, y), state.percept.contact, job.limits):
        raise TrialAborted(
            f"the skill may not start with the tip {depth * 1e3:.1f} mm deep and"
            f" {math.hypot(x, y) * 1e3:.1f} mm off the axis: free the key, bring it before the lock"
        )
    return state


def finished(now: Decision, *, extract: bool) -> bool:
    """Tell whether a trial is over."""
    return now.phase == END or (now.verdict != OPEN and not extract)
