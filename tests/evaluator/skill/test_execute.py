"""The closed loop: compiled and tick by tick are one, static force, heart beat."""

from __future__ import annotations

import numpy as np
import pytest

from shearline.evaluator.base import TrialAborted
from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.skill import manipulation
from shearline.evaluator.skill.baselines import TUPLES, tuple_of
from shearline.evaluator.skill.execute import Job, execute
from shearline.evaluator.skill.loop import CHUNK_TICKS, execute_compiled
from shearline.evaluator.skill.physics import random_tuples
from shearline.evaluator.skill.semantic import END, PHASES, SEARCH, SUCCESS, VERDICTS
from shearline.evaluator.skill.trace import COLUMNS, digest, trace
from shearline.sims.plant import Setup
from shearline.sims.scene import Q_START, TICK_S, believed_lock_pose

_COLUMN = {name: i for i, (name, _) in enumerate(COLUMNS)}


def _job(task: KeylockTask, **named: float) -> Job:
    job = task.job(tuple_of(TUPLES["centre-push"]))
    return job._replace(p=job.p._replace(**named))


def test_tick_by_tick_in_python_is_the_compiled_loop_to_the_last_bit(task: KeylockTask) -> None:
    setup, job = Setup(), _job(task, con_speed=0.1)
    end, rows = execute_compiled(task.plant, setup, job, lambda: None)
    other_end, other_rows = execute(task.plant, setup, job, lambda: None)
    assert end == other_end
    assert digest(rows) == digest(other_rows)


def test_extraction_pulls_the_key_out_again(task: KeylockTask) -> None:
    job = _job(task)._replace(extract=True)
    end, rows = execute_compiled(task.plant, Setup(), job, lambda: None)
    assert (end.phase, end.verdict) == (END, SUCCESS)
    assert rows[-1, _COLUMN["depth"]] < -1e-3
    names = [name for _, name in trace(rows, end, TICK_S).events]
    assert names == ["approach", "contact", "mouth", "insertion", "extraction", "success", "end"]


def test_a_static_push_is_stiffness_times_lead(task: KeylockTask) -> None:
    """The tip stands on the face, beside the mouth; the reference leads it by its bound."""
    off = np.array([2.5e-3, 2.5e-3, 0.0])
    setup = Setup(lock=believed_lock_pose().moved(off, np.zeros(3)), friction=1.0)
    job = _job(task, con_force=1e9, con_k_xy=2000.0, con_speed=0.1, ins_k_rot=200.0, xi=1.0)
    end, rows = execute_compiled(task.plant, setup, job, lambda: None)
    assert VERDICTS[end.verdict] in {"search", "time"}
    force = -rows[-1, _COLUMN["wrench.fz"]]
    assert force == pytest.approx(manipulation.AXIAL_K * manipulation.LEAD_M, rel=0.01)


def test_the_heart_beats_in_every_chunk_and_may_end_the_trial(task: KeylockTask) -> None:
    beats: list[int] = []
    _, rows = execute_compiled(task.plant, Setup(), _job(task), lambda: beats.append(1))
    assert len(beats) == -(-len(rows) // CHUNK_TICKS)

    def stop() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        execute_compiled(task.plant, Setup(), _job(task), stop)


def test_a_trial_does_not_start_with_the_key_in_the_lock(task: KeylockTask) -> None:
    lock = believed_lock_pose().moved(np.array([0.0, 0.0, -20e-3]), np.zeros(3))
    with pytest.raises(TrialAborted, match=r"may not start with the tip 5\.0 mm deep"):
        execute_compiled(task.plant, Setup(lock=lock), _job(task), lambda: None)


def test_a_lock_that_is_nowhere_near_is_searched_for_and_given_up(task: KeylockTask) -> None:
    lock = believed_lock_pose().moved(np.array([3e-3, 0.0, 0.0]), np.zeros(3))
    job = _job(task, ins_push=5.0, wig_a_x=0.0, wig_a_y=0.0, wig_a_rx=0.0, wig_a_ry=0.0)
    end, _ = execute_compiled(task.plant, Setup(lock=lock), job, lambda: None)
    assert end.verdict in {SEARCH, VERDICTS.index("time")}


def test_every_column_is_finite_and_the_arm_starts_at_rest(task: KeylockTask) -> None:
    for seed, theta in enumerate(random_tuples(task, 3)):
        outcome = task.run(theta, seed, lambda: None)
        assert outcome.trace is not None
        columns = outcome.trace.columns
        assert len(columns) == len(COLUMNS) == 51
        assert all(np.isfinite(values).all() for _, values in columns.values())
        assert columns["q.4"][1][0] == np.float32(Q_START[3])
        assert set(np.unique(columns["phase"][1]).astype(int)) <= set(range(len(PHASES)))
