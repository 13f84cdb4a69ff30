"""The physics can be trusted: short versions of the proofs that ``physics`` prints."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.evaluator.skill import physics
from shearline.sims.lock import Lock
from shearline.sims.panda import LINKS, Array
from shearline.sims.plant import Setup
from shearline.sims.scene import Q_START, Scene, tip_pose

_ANGLES = st.tuples(*(st.floats(low + 0.01, high - 0.01) for low, high in
                      (link.range_rad for link in LINKS)))  # fmt: skip


def test_energy_is_kept_in_free_space() -> None:
    assert physics.energy_drift() < 2e-3


@given(q=_ANGLES)
@settings(max_examples=5, deadline=None)
def test_gravity_compensation_is_the_gradient_of_the_height(q: tuple[float, ...]) -> None:
    assert physics.gravity_error(np.array(q)) < 1e-6


def test_penetration_stays_below_the_clearance() -> None:
    deepest = np.array(list(physics.penetrations(12))).max(axis=0)
    assert deepest[0] < Lock().clearance_x_m
    assert deepest[1] < Lock().clearance_y_m
    assert deepest.max() > 0.0  # it does measure contact


def test_penetration_is_measured_from_the_wall() -> None:
    scene, setup = Scene(), Setup()
    rows = np.zeros((1, 51))
    rows[0, :7] = Q_START
    rows[0, 28:31] = (scene.lock.clearance_x_m + 1e-5, scene.lock.clearance_y_m - 1e-5, 10e-3)
    np.testing.assert_allclose(physics.penetration(scene, setup, rows), (1e-5, -1e-5), atol=1e-12)
    rows[0, 30] = -1e-3
    assert physics.penetration(scene, setup, rows) == (0.0, 0.0)


def test_the_keys_rotation_is_that_of_the_kinematics() -> None:
    q: Array = np.array([Q_START, Q_START + 0.1])
    for angles, rotation in zip(q, physics.key_rotations(q), strict=True):
        np.testing.assert_allclose(rotation, tip_pose(angles).rotation, atol=1e-14)


@pytest.mark.slow
def test_the_verdict_is_that_of_a_four_times_finer_step() -> None:
    assert physics.verdict_agreement(50) >= 0.98


@pytest.mark.slow
def test_the_proofs_print_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert physics.main(["--tuples", "2", "--trials", "20"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["penetration_x_um"][1] < found["clearance_x_um"]
