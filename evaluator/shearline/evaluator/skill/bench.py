"""How close the compiled trial loop comes to the physical limit.

The limit is a bare loop of ``mj_step`` over the same contact states. Both sides run in one process
on one core, in short slices that take turns, and the thread's CPU time is what counts, so that a
busy machine slows both alike. In each slice the bare side starts from the very state that the trial
has there and applies the torques that the trial applies: it goes through the same contacts and
solves the same systems, to the last bit.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import mujoco
import numpy as np

from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.keylock_draw import draw_setup
from shearline.evaluator.keylock_variation import level
from shearline.evaluator.skill.execute import noise_of
from shearline.evaluator.skill.loop import execute_compiled, run_ticks
from shearline.evaluator.skill.semantic import OPEN, beginning
from shearline.evaluator.skill.skill import empty_state
from shearline.evaluator.skill.trace import COLUMNS
from shearline.sims.compiled import call_with_two_addresses, compiled
from shearline.sims.mujoco_plant import library_address
from shearline.sims.panda import JOINTS, Array
from shearline.sims.scene import TICK_S

#: Ticks in a slice: long enough that the clock and the call weigh nothing.
SLICE_TICKS = 200

_TAU = slice(2 * JOINTS, 3 * JOINTS)
_DEPTH = next(i for i, (name, _) in enumerate(COLUMNS) if name == "depth")


@dataclass
class Tally:
    """Ticks that both sides ran, and the CPU time each took [s]."""

    ticks: int = 0
    loop_s: float = 0.0
    bare_s: float = 0.0

    def add(self, ticks: int, loop_s: float, bare_s: float) -> None:
        """Count one slice."""
        self.ticks += ticks
        self.loop_s += loop_s
        self.bare_s += bare_s

    @property
    def ratio(self) -> float:
        """Speed of the loop over that of the bare one."""
        return self.bare_s / self.loop_s

    @property
    def x_realtime(self) -> float:
        """Simulated time over CPU time of the loop."""
        return self.ticks * TICK_S / self.loop_s


def measure(seconds: float = 10.0) -> dict[str, float]:
    """Compare the compiled loop with the bare one.

    Args:
        seconds: For how long to measure, after warming up [s].

    Returns:
        ``ratio`` (speed of the trial loop over that of the bare one, key in the lock),
        ``x_realtime`` (whole trials), the same for free space and for the key in the lock
        (``ratio_free``, ``x_realtime_contact``), ``ticks_per_s`` and ``bare_ticks_per_s`` with the
        key in the lock, ``ticks`` measured.
    """
    task = KeylockTask()
    task.warm()
    inside, free = Tally(), Tally()
    _compare(task, 0, Tally(), Tally())
    end_s = time.perf_counter() + seconds
    seed = 1
    while time.perf_counter() < end_s or not inside.ticks:
        _compare(task, seed, inside, free)
        seed += 1
    total_s = inside.loop_s + free.loop_s
    return {
        "ratio": inside.ratio,
        "ratio_free": free.ratio,
        "x_realtime": (inside.ticks + free.ticks) * TICK_S / total_s,
        "x_realtime_contact": inside.x_realtime,
        "ticks_per_s": inside.ticks / inside.loop_s,
        "bare_ticks_per_s": inside.ticks / inside.bare_s,
        "ticks": float(inside.ticks + free.ticks),
    }


@compiled
def _bare_loop(step: int, model: int, data: int, substeps: int, applied: Array, tau: Array) -> None:
    for i in range(tau.shape[0]):
        for j in range(tau.shape[1]):
            applied[j] = tau[i, j]
        for _ in range(substeps):
            call_with_two_addresses(step, model, data)


def _compare(task: KeylockTask, seed: int, inside: Tally, free: Tally) -> None:
    """Run the trial of a random tuple once for its torques, then slice by slice on both sides."""
    plant = task.plant
    setup, _ = draw_setup(level("keylock"), seed)
    bounds = np.array([(low, high) for _, low, high in task.spec.space.values()])
    job = task.job(np.random.default_rng(seed).uniform(bounds[:, 0], bounds[:, 1]))
    _, planned = execute_compiled(plant, setup, job, lambda: None)
    rows = np.empty_like(planned)
    plant.reset(setup)
    bare = mujoco.MjData(plant.model)
    bare_step = library_address("mj_step")
    bare_data = bare._address  # noqa: SLF001 - MuJoCo's documented way to the C struct
    state, now, done, noise = empty_state(), beginning(), 0, noise_of(setup)
    h = plant.handles
    while now.verdict == OPEN:
        until = min(done + SLICE_TICKS, len(planned))
        mujoco.mj_copyData(bare, plant.model, plant.data)
        tau = planned[done:until, _TAU]
        times, begun = {}, done
        for side in ("loop", "bare") if seed % 2 else ("bare", "loop"):
            start_s = time.thread_time()
            if side == "bare":
                _bare_loop(bare_step, h.model, bare_data, h.substeps, bare.qfrc_applied, tau)
            else:
                now, done = run_ticks(h, state, now, job, noise, rows, done, until)
            times[side] = time.thread_time() - start_s
        assert np.array_equal(bare.qpos, plant.data.qpos), "the sides went different ways"
        tally = inside if planned[begun, _DEPTH] > 0.0 else free
        tally.add(done - begun, times["loop"], times["bare"])
