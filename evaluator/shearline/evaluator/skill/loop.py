"""One trial of the skill in MuJoCo, in one compiled loop.

The layers are composed with MuJoCo's primitives; the loop returns to Python often enough for a
heart beat. It is :func:`shearline.evaluator.skill.execute.execute` to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shearline.evaluator.base import TrialAborted
from shearline.evaluator.skill.execute import (
    TICKS_MAX,
    TRIAL_MAX_S,
    Job,
    begin,
    finished,
    noise_of,
    tick_and_write,
)
from shearline.evaluator.skill.semantic import END, OPEN, Decision, beginning
from shearline.evaluator.skill.skill import State
from shearline.evaluator.skill.trace import COLUMNS
from shearline.sims.compiled import compiled
from shearline.sims.mujoco_plant import Handles, MujocoPlant, begin_tick, end_tick
from shearline.sims.panda import Array
from shearline.sims.plant import Setup

#: Ticks between two heart beats: about 40 ms of wall time in contact.
CHUNK_TICKS = 500


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
    state, now, done, noise = begin(plant, setup, job), beginning(), 0, noise_of(setup)
    while not finished(now, extract=job.extract):
        if done >= TICKS_MAX:
            raise TrialAborted(f"no verdict after {TRIAL_MAX_S:.1f} s: the skill does not end")
        until = min(done + CHUNK_TICKS, TICKS_MAX)
        now, done = run_ticks(plant.handles, state, now, job, noise, rows, done, until)
        plant.check()
        beat()
    return now, rows[:done]


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
        now = tick_and_write(state, now, job, noise, rows, done)
        end_tick(handles, state.feel.tau)
        done += 1
        if now.phase == END or (now.verdict != OPEN and not job.extract):
            break
    return now, done
