"""A hinge that moves in steps is where the hinge itself would be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.sims.hinge import Hinge, stepped

INERTIA = 5e-6

stiffnesses = st.floats(0.1, 40.0)
ratios = st.floats(0.0, 0.9)
steps = st.floats(1e-5, 1e-3)


def _damping(stiffness: float, ratio: float) -> float:
    return 2.0 * ratio * math.sqrt(stiffness * INERTIA)


def _swung(hinge: Hinge, angle: float, speed: float, step_s: float, count: int) -> np.ndarray:
    """Return the angles that semi-implicit Euler goes through."""
    angles = [angle]
    for _ in range(count):
        speed += step_s * hinge.torque(angle, speed) / (INERTIA + hinge.added)
        angle += step_s * speed
        angles.append(angle)
    return np.array(angles)


@given(stiffness=stiffnesses, ratio=ratios, step_s=steps)
def test_steps_are_samples_of_the_damped_swing(
    stiffness: float, ratio: float, step_s: float
) -> None:
    damping = _damping(stiffness, ratio)
    rate = damping / (2.0 * INERTIA)
    turn = math.sqrt(stiffness / INERTIA - rate**2)
    if turn * step_s > math.pi:
        return  # no step can show it
    times = step_s * np.arange(-1, 60)
    exact = np.exp(-rate * times) * np.cos(turn * times)
    speed = (exact[1] - exact[0]) / step_s
    found = _swung(stepped(stiffness, damping, INERTIA, step_s), exact[1], speed, step_s, 59)
    np.testing.assert_allclose(found, exact[1:], atol=1e-6)


@given(stiffness=st.floats(0.1, 1e6), ratio=st.floats(0.0, 0.99), step_s=steps)
def test_no_swing_however_stiff_gains_energy_from_a_step(
    stiffness: float, ratio: float, step_s: float
) -> None:
    """Of two samples in turn, the form that an undamped swing would keep is its energy."""
    hinge = stepped(stiffness, _damping(stiffness, ratio), INERTIA, step_s)
    q = _swung(hinge, 1.0, 0.0, step_s, 100)
    whole = INERTIA + hinge.added
    kept = 1.0 - hinge.damping * step_s / whole
    both = 1.0 + kept - stiffness * step_s**2 / whole
    energy = q[1:] ** 2 - both * q[1:] * q[:-1] + kept * q[:-1] ** 2
    assert np.all(energy[1:] <= energy[:-1] * (1.0 + 1e-9) + 1e-12)
    assert np.all(energy >= -1e-9)


@given(stiffness=stiffnesses, ratio=st.floats(1.0, 20.0), step_s=steps)
def test_a_creeping_hinge_goes_home_without_passing_it(
    stiffness: float, ratio: float, step_s: float
) -> None:
    hinge = stepped(stiffness, _damping(stiffness, ratio), INERTIA, step_s)
    q = _swung(hinge, 1.0, 0.0, step_s, 100)
    assert np.all(np.diff(q) <= 1e-12)
    assert q[-1] >= -1e-9


@given(stiffness=stiffnesses, ratio=ratios, step_s=steps)
def test_what_stays_under_a_load_bends_as_the_spring_says(
    stiffness: float, ratio: float, step_s: float
) -> None:
    hinge = stepped(stiffness, _damping(stiffness, ratio), INERTIA, step_s)
    assert hinge.torque(0.1, 0.0) == -0.1 * stiffness


def test_fine_steps_need_no_help() -> None:
    hinge = stepped(4.8, 1.5e-3, INERTIA, 1e-7)
    assert hinge.added == pytest.approx(0.0, abs=1e-4 * INERTIA)
    assert hinge.damping == pytest.approx(1.5e-3, rel=1e-4)
