"""One trial of the skill on a plant, as a closed loop.

:func:`execute_compiled` composes the layers with MuJoCo's primitives into one compiled loop that
returns to Python often enough for a heart beat; :func:`execute` is the same loop tick by tick for
any other plant. Both write the same rows.
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
from shearline.sims.mujoco_plant import Handles, MujocoPlant, begin_tick, end_tick
from shearline.sims.panda import JOINTS, Array
from shearline.sims.plant import Percept, Plant, Setup
from shearline.sims.scene import TICK_S

#: No trial is longer than all its phases together [s].
TRIAL_MAX_S = APPROACH_S + SETTLE_S + SEARCH_MAX_S + TIME_MAX_S + EXTRACTION_MAX_S + 0.1

TICKS_MAX = round(TRIAL_MAX_S / TICK_S)

#: Ticks between two heart beats: about 40 ms of wall time in contact.
CHUNK_TICKS = 500


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


def execute_compiled(
    plant: MujocoPlant, setup: Setup, job: Job, beat: Callable[[], None], rows: Array | None = None
) -> tuple[Decision, Array]:
    """Run one trial in MuJoCo in a compiled loop.

    Args:
        plant: Is reset first.
        setup: What differs in this trial.
        job: What to do.
        beat: Called every :data:`CHUNK_TICKS`; what it raises ends the trial.
        rows: Buffer ``(TICKS_MAX, columns)`` to write into, or ``None`` for a new one.

    Returns:
        How it ended, and the rows ``(ticks, columns)`` of the trace (a view of the buffer).

    Raises:
        TrialAborted: If the preconditions do not hold or no verdict was reached.
        PlantError: If the simulation is no longer physical.
    """
    rows = np.empty((TICKS_MAX, len(COLUMNS))) if rows is None else rows
    state, now, done, noise = _begin(plant, setup, job), beginning(), 0, noise_of(setup)
    while not _finished(now, extract=job.extract):
        if done >= TICKS_MAX:
            raise TrialAborted(f"no verdict after {TRIAL_MAX_S:.1f} s: the skill does not end")
        until = min(done + CHUNK_TICKS, TICKS_MAX)
        now, done = run_ticks(plant.handles, state, now, job, noise, rows, done, until)
        plant.check()
        beat()
    return now, rows[:done]


def execute(
    plant: Plant, setup: Setup, job: Job, beat: Callable[[], None]
) -> tuple[Decision, Array]:
    """Run one trial on any plant, tick by tick; arguments and results as above."""
    rows = np.empty((TICKS_MAX, len(COLUMNS)))
    state, now, done, noise = _begin(plant, setup, job), beginning(), 0, noise_of(setup)
    while not _finished(now, extract=job.extract):
        if done >= TICKS_MAX:
            raise TrialAborted(f"no verdict after {TRIAL_MAX_S:.1f} s: the skill does not end")
        plant.sense(state.percept)
        disturb(state.percept, noise, done)
        now = tick(state, now, job.p, job.limits, job.arm, TICK_S)
        write_row(rows[done], state, now)
        plant.step(state.feel.tau)
        done += 1
        if done % CHUNK_TICKS == 0:
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
def run_ticks(
    handles: Handles,
    state: State,
    now: Decision,
    job: Job,
    noise: Array,
    rows: Array,
    done: int,
    until: int,
) -> tuple[Decision, int]:
    """Run ticks ``done`` to ``until`` or to the end of the skill; return where it stands."""
    while done < until:
        begin_tick(handles, state.percept)
        disturb(state.percept, noise, done)
        now = tick(state, now, job.p, job.limits, job.arm, TICK_S)
        write_row(rows[done], state, now)
        end_tick(handles, state.feel.tau)
        done += 1
        if now.phase == END or (now.verdict != OPEN and not job.extract):
            break
    return now, done


def _begin(plant: Plant, setup: Setup, job: Job) -> State:
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


def _finished(now: Decision, *, extract: bool) -> bool:
    return now.phase == END or (now.verdict != OPEN and not extract)
