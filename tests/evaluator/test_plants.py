"""The plant is the evaluator's choice: tasks on any of them are one task, outcomes name theirs."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from shearline.deploy import options
from shearline.evaluator.builtin import builtin_task
from shearline.evaluator.keylock import BulletKeylockTask, KeylockTask
from shearline.evaluator.plants import PLANTS, plant_of
from shearline.evaluator.skill.baselines import TUPLES, tuple_of
from shearline.evaluator.skill.physics import penetrations
from shearline.evaluator.skill.trace import COLUMNS
from shearline.protocol.task import digest
from shearline.sims.lock import Lock


@pytest.fixture(scope="module")
def task() -> BulletKeylockTask:
    task = BulletKeylockTask()
    task.warm()
    return task


def test_the_command_line_offers_what_there_is() -> None:
    assert options.PLANTS == PLANTS


def test_a_task_is_the_same_on_every_plant() -> None:
    assert len({digest(builtin_task("keylock", plant).spec) for plant in PLANTS}) == 1


def test_a_task_without_a_plant_does_not_mind() -> None:
    assert builtin_task("sphere", "pybullet").engine == builtin_task("sphere").engine


def test_an_engine_names_its_plant(task: BulletKeylockTask) -> None:
    assert plant_of(task.engine) == "pybullet"
    assert plant_of(KeylockTask().engine) == "mujoco"
    assert plant_of("python 3.11 function mine:f") == "mujoco"


def test_a_firm_push_opens_the_lock_in_pybullet_too(task: BulletKeylockTask) -> None:
    outcome = task.run(tuple_of(TUPLES["swift"]), 1001, lambda: None)
    assert outcome.success
    assert 0.1 < outcome.cost < 1.0
    assert outcome.trace is not None
    assert list(outcome.trace.columns) == [name for name, _ in COLUMNS]
    pins = [outcome.trace.columns[f"pin.{i + 1}"][1].max() for i in range(5)]
    assert all(1e-3 < travel < 3e-3 for travel in pins)


def test_the_same_seed_gives_the_same_trace_in_another_process(task: BulletKeylockTask) -> None:
    program = (
        "from shearline.evaluator.keylock import BulletKeylockTask\n"
        "from shearline.evaluator.skill.baselines import TUPLES, tuple_of\n"
        "task = BulletKeylockTask()\n"
        "print(task.run(tuple_of(TUPLES['centre-push']), 3, lambda: None).digest)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    here = task.run(tuple_of(TUPLES["centre-push"]), 3, lambda: None).digest
    assert done.stdout.strip() == here


def test_a_trial_leaves_nothing_behind_for_the_next(task: BulletKeylockTask) -> None:
    theta = tuple_of(TUPLES["centre-push"])
    before = task.run(theta, 6, lambda: None).digest
    jam = BulletKeylockTask("keylock-jam")
    jam.plant = task.plant
    jam.run(theta, 7, lambda: None)
    assert task.run(theta, 6, lambda: None).digest == before


def test_the_heart_beats_and_may_end_the_trial(task: BulletKeylockTask) -> None:
    def beat() -> None:
        raise TimeoutError

    with pytest.raises(TimeoutError):
        task.run(tuple_of(TUPLES["centre"]), 0, beat)


@pytest.mark.slow
def test_no_key_goes_through_a_wall(task: BulletKeylockTask) -> None:
    deepest = np.array(list(penetrations(12, task=task))).max(axis=0)
    assert deepest[0] < Lock().clearance_x_m
    assert deepest[1] < Lock().clearance_y_m
    assert deepest.max() > 0.0
