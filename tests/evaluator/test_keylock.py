"""The key-in-lock task: its noise, its cost, and a clock that nobody can move."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.evaluator.base import Outcome, TrialAborted
from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.keylock_draw import draw_setup
from shearline.evaluator.keylock_spec import keylock_spec
from shearline.evaluator.keylock_variation import LEVELS, level
from shearline.evaluator.skill.baselines import TUPLES, tuple_of
from shearline.evaluator.skill.parameters import BOUNDS, space
from shearline.protocol.errors import ConfigError
from shearline.sims.lock import Lock
from shearline.sims.plant import PlantError
from shearline.sims.scene import believed_lock_pose

_UNIT = st.lists(st.floats(0.0, 1.0), min_size=len(BOUNDS), max_size=len(BOUNDS))


@pytest.fixture(scope="module")
def task() -> KeylockTask:
    task = KeylockTask()
    task.warm()
    return task


def _check_cost(outcome: Outcome) -> None:
    """Compute the cost again from nothing but the depth in the trace."""
    assert outcome.trace is not None
    depth = outcome.trace.columns["depth"][1].astype(np.float64)
    inside = np.flatnonzero(depth >= 0.0)
    if outcome.success:
        clock_s = (len(depth) - 1 - inside[0]) * 1e-3
        assert outcome.cost == pytest.approx(clock_s, abs=1e-9)
        assert depth[-1] >= 24.5e-3 - 1e-9
    else:
        missing = min(max(24.5e-3 - depth[-1], 0.0), 24.5e-3)
        assert outcome.cost == pytest.approx(5.0 + 400.0 * missing, abs=1e-5)
        assert outcome.why in {"torque", "roi", "time", "search"}


# Slow approaches, high thresholds, no push, corners of the box: what might cheat the clock.
_CHEATS = [
    {"con_speed": 0.005, "con_force": 12.0, "ins_push": 20.0},
    {"con_speed": 0.005, "con_force": 12.0, "ins_push": 0.0},
    {"con_speed": 0.1, "con_force": 12.0, "con_k_xy": 100.0},
    {"con_speed": 0.1, "con_force": 1.0, "ins_push": 20.0},
    {"app_tilt_x": 0.1396, "app_tilt_y": 0.1396, "con_force": 12.0, "con_speed": 0.005},
    {"app_off_x": 1e-3, "app_off_y": 1e-3, "ins_speed": 0.002, "ins_push": 20.0},
]


@pytest.mark.parametrize("cheat", _CHEATS)
def test_no_known_trick_moves_the_clock(task: KeylockTask, cheat: dict[str, float]) -> None:
    theta = tuple_of(TUPLES["centre-push"])
    for name, value in cheat.items():
        theta[list(BOUNDS).index(name)] = value
    _check_cost(task.run(theta, 3, lambda: None))


@given(u=_UNIT, seed=st.integers(0, 2**63 - 1))
@settings(max_examples=12, deadline=None)
def test_no_parameter_moves_the_clock(task: KeylockTask, u: list[float], seed: int) -> None:
    _check_cost(task.run(space().denormalise(u), seed, lambda: None))


@pytest.mark.parametrize("name", LEVELS)
@given(seed=st.integers(0, 2**63 - 1))
@settings(max_examples=30, deadline=None)
def test_noise_is_clipped_and_belongs_to_its_seed(name: str, seed: int) -> None:
    chosen = level(name)
    setup, off = draw_setup(chosen, seed)
    again, _ = draw_setup(chosen, seed)
    np.testing.assert_array_equal(setup.lock.position, again.lock.position)
    assert setup.pin_scale == again.pin_scale
    assert np.all(np.abs(off[:3]) <= 2.0 * chosen.offset_m)
    assert np.all(np.abs(off[3:]) <= 2.0 * chosen.tilt_rad)
    assert all(abs(f - 1.0) <= chosen.pin_spread for f in setup.pin_scale)
    if chosen.friction is not None:
        assert setup.friction is not None
        assert chosen.friction[0] <= setup.friction <= chosen.friction[1]


def test_noise_has_the_stated_spread() -> None:
    off = np.array([draw_setup(level("keylock"), seed)[1] for seed in range(2000)])
    # Clipping a normal at two standard deviations leaves .960 of its own.
    np.testing.assert_allclose(off[:, :3].std(axis=0), 0.960 * 0.3e-3, rtol=0.06)
    np.testing.assert_allclose(off[:, 3:].std(axis=0), 0.960 * np.radians(0.5), rtol=0.06)
    assert abs(off.mean(axis=0)[:3]).max() < 3e-5


def test_the_lock_is_where_the_noise_says() -> None:
    setup, off = draw_setup(level("keylock"), 5)
    moved = believed_lock_pose().rotation.T @ (setup.lock.position - believed_lock_pose().position)
    np.testing.assert_allclose(moved, off[:3], atol=1e-15)


def test_the_same_seed_gives_the_same_trace_in_another_process(task: KeylockTask) -> None:
    code = (
        "from shearline.evaluator.keylock import KeylockTask\n"
        "from shearline.evaluator.skill.baselines import TUPLES, tuple_of\n"
        "task = KeylockTask()\n"
        "print(task.run(tuple_of(TUPLES['centre-push']), 11, lambda: None).digest)"
    )
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.strip()
    # What ran before must not matter.
    task.run(tuple_of(TUPLES["centre-push"]), 12, lambda: None)
    outcome = task.run(tuple_of(TUPLES["centre-push"]), 11, lambda: None)
    assert outcome.digest == found
    assert len(found) == 32


def test_another_seed_gives_another_trace(task: KeylockTask) -> None:
    theta = tuple_of(TUPLES["centre-push"])
    assert task.run(theta, 1, lambda: None).digest != task.run(theta, 2, lambda: None).digest


def test_a_friction_of_one_trial_does_not_leak_into_the_next(task: KeylockTask) -> None:
    before = task.run(tuple_of(TUPLES["centre-push"]), 6, lambda: None).digest
    jam = KeylockTask("keylock-jam")
    jam.plant = task.plant
    jam.run(tuple_of(TUPLES["centre-push"]), 6, lambda: None)
    assert task.run(tuple_of(TUPLES["centre-push"]), 6, lambda: None).digest == before


def test_lower_limits_can_only_turn_a_trial_into_a_torque_failure(task: KeylockTask) -> None:
    limited = KeylockTask("keylock-limit")
    for seed in range(6):
        free, strict = (
            t.run(tuple_of(TUPLES["centre-push"]), seed, lambda: None) for t in (task, limited)
        )
        assert strict.why == "torque" or strict.digest == free.digest


def test_a_broken_simulation_has_no_verdict(
    task: KeylockTask, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> None:
        raise PlantError("no longer physical")

    monkeypatch.setattr(task.plant, "check", broken)
    with pytest.raises(TrialAborted, match="no longer physical"):
        task.run(tuple_of(TUPLES["centre-push"]), 0, lambda: None)


def test_an_unknown_level_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ConfigError, match="keylock-limit, keylock-jam"):
        KeylockTask("keylok")


def test_both_sides_mean_the_same_task(task: KeylockTask) -> None:
    assert task.spec == keylock_spec("keylock")
    assert keylock_spec("keylock") != keylock_spec("keylock-limit")
    assert task.spec.options["depth_m"] == Lock().depth_m
    assert task.engine.endswith("skill 1")
    assert replace(level("keylock"), torque_big=26.0, torque_small=7.8) == level("keylock-limit")
