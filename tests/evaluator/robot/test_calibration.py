"""What the operator's hand shows, and when it is not believed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from evaluator.robot.rig import O_T_LOCK
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.robot.bounds import ToolTable
from shearline.evaluator.robot.calibration import REPEATS, SPREAD_M, calibrated, mean_pose
from shearline.evaluator.robot.errors import RobotRefused
from shearline.evaluator.robot.frames import angle, apart, inverse, is_pose, pose, rpy

SEATED_M = 0.025
TOOL = ToolTable()
angles = st.tuples(*[st.floats(-1.4, 1.4)] * 3)


def shown(spread_m: float, spread_rad: float = 0.0) -> np.ndarray:
    """Return poses of a key that sits in the lock, each a little elsewhere."""
    seated = O_T_LOCK @ pose((0.0, 0.0, SEATED_M), np.eye(3))
    steps = np.linspace(-1.0, 1.0, REPEATS)
    return np.array(
        [seated @ pose((spread_m * s, 0.0, 0.0), rpy((spread_rad * s, 0.0, 0.0))) for s in steps]
    )


def test_the_mouth_lies_before_the_seated_tip_by_its_depth() -> None:
    found = calibrated(shown(1e-4), TOOL, SEATED_M)
    off_m, off_rad = apart(O_T_LOCK, found.pose())
    assert off_m < 1e-9
    assert off_rad < 1e-9
    assert found.spread_m == pytest.approx(1e-4)


@pytest.mark.parametrize(
    ("spread_m", "spread_rad"), [(1.1 * SPREAD_M, 0.0), (1e-5, math.radians(0.35))]
)
def test_repeats_that_do_not_agree_are_refused(spread_m: float, spread_rad: float) -> None:
    with pytest.raises(RobotRefused, match="off their mean"):
        calibrated(shown(spread_m, spread_rad), TOOL, SEATED_M)


def test_one_pose_five_times_is_no_calibration() -> None:
    with pytest.raises(RobotRefused, match="take the key out"):
        calibrated(shown(0.0), TOOL, SEATED_M)


def test_too_few_repeats_are_refused() -> None:
    with pytest.raises(RobotRefused, match="show it 5 times"):
        calibrated(shown(1e-4)[:3], TOOL, SEATED_M)


@given(angles, angles)
def test_a_pose_and_its_inverse_are_one(one: tuple[float, ...], other: tuple[float, ...]) -> None:
    made = pose(one, rpy(other))
    assert is_pose(made)
    off_m, off_rad = apart(np.eye(4), made @ inverse(made))
    assert off_m < 1e-12
    assert off_rad < 1e-6


@given(angles)
def test_the_mean_of_one_pose_is_that_pose(turn: tuple[float, ...]) -> None:
    made = pose((1.0, 2.0, 3.0), rpy(turn))
    assert apart(made, mean_pose(np.stack([made, made])))[1] < 1e-6
    assert 0.0 <= angle(made[:3, :3]) <= math.pi
