"""What switches draw: from the seed alone, each its own, and nothing of the plain levels' draws."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.keylock_draw import draw_setup, scene_of
from shearline.evaluator.keylock_variation import level
from shearline.evaluator.skill.execute import execute, noise_of
from shearline.evaluator.skill.loop import execute_compiled
from shearline.evaluator.skill.trace import digest
from shearline.sims.plant import Setup
from shearline.sims.scene import Scene

EVERYTHING = "keylock-limit+friction+pins+grasp+pads+noise+key-b"


@pytest.fixture(scope="module")
def task() -> KeylockTask:
    return KeylockTask(EVERYTHING)


def _pushed(task: KeylockTask, push_n: float = 19.0) -> np.ndarray:
    space = task.spec.space
    named = {name: (low + high) / 2.0 for name, (_, low, high) in space.items()}
    return np.array(list((named | {"ins_push": push_n}).values()))


def test_a_seed_leaves_the_lock_where_it_stands_whatever_is_switched_on() -> None:
    plain, off = draw_setup(level("keylock"), 5)
    switched, same = draw_setup(level("keylock+grasp+pads+noise"), 5)
    assert np.array_equal(off, same)
    assert switched.pin_scale == plain.pin_scale


def test_switches_do_not_disturb_each_other() -> None:
    all_on, _ = draw_setup(level("keylock+grasp+pads+noise"), 8)
    for switch, fields in {"grasp": ["grip"], "pads": ["pad_scale"], "noise": ["noise"]}.items():
        alone, _ = draw_setup(level(f"keylock+{switch}"), 8)
        for name in fields:
            assert getattr(alone, name) == getattr(all_on, name)
            assert getattr(alone, name) != getattr(Setup(), name)


def test_draws_stay_in_their_ranges_and_fill_them() -> None:
    chosen = level(EVERYTHING)
    setups = [draw_setup(chosen, seed)[0] for seed in range(500)]
    grip = np.array([setup.grip for setup in setups])
    assert np.all(np.abs(grip[:, 1:3]) <= 2.0 * chosen.grip_m)
    assert np.all(grip[:, [0, 4, 5]] == 0.0)
    assert grip[:, 3].std() == pytest.approx(0.88 * chosen.grip_rad, rel=0.1)  # clipped at 2 sd
    scales = np.log2([setup.pad_scale for setup in setups])
    assert -1.0 <= scales.min() < -0.95
    assert 0.95 < scales.max() <= 1.0


def test_the_noise_has_the_bias_and_the_spread_that_are_asked_for() -> None:
    setup, _ = draw_setup(level("keylock+noise"), 3)
    assert setup.noise is not None
    added = noise_of(setup)
    assert np.array_equal(added, noise_of(setup))
    assert added.mean(axis=0) == pytest.approx(setup.noise.bias, abs=0.01)
    assert added.std(axis=0) == pytest.approx(0.2, rel=0.05)
    assert noise_of(Setup()).shape == (0, 7)


def test_a_plain_level_has_the_plain_scene() -> None:
    assert scene_of(level("keylock-jam")) == Scene()
    assert scene_of(level("keylock+noise")) == Scene()
    assert scene_of(level("keylock+key-b")) != Scene()


def test_trials_with_every_switch_come_out_the_same_again_and_on_both_loops(
    task: KeylockTask,
) -> None:
    chosen = level(EVERYTHING)
    setup, _ = draw_setup(chosen, 4)
    job = task.job(_pushed(task))
    end, rows = execute_compiled(task.plant, setup, job, lambda: None)
    again, same = execute(task.plant, setup, job, lambda: None)
    assert end == again
    assert digest(rows) == digest(same)


def test_the_arm_does_not_feel_how_the_key_sits(task: KeylockTask) -> None:
    from shearline.sims.plant import empty_percept  # noqa: PLC0415

    straight, crooked = empty_percept(), empty_percept()
    task.plant.reset(Setup())
    task.plant.sense(straight)
    task.plant.reset(replace(Setup(), grip=(0.0, 0.0, 0.0, math.radians(1.0), 0.0, 0.0)))
    task.plant.sense(crooked)
    assert np.array_equal(straight.tip, crooked.tip)
    assert np.array_equal(straight.jacobian, crooked.jacobian)
    shift = np.linalg.norm(crooked.in_lock - straight.in_lock)
    assert shift == pytest.approx(32e-3 * math.radians(1.0), rel=0.01)
