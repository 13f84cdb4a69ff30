"""Where the lock is, shown by hand: the key is put in a few times, and the poses must agree.

The operator leads the arm until the key sits in the lock, lets go, says so, pulls it out and does
it again. What the hand shows is the tip at a known depth; the mean of the repeats, moved back by
that depth, is the lock's mouth.
"""

from __future__ import annotations

import math
import time

import numpy as np

from shearline.evaluator.robot.bounds import ToolTable
from shearline.evaluator.robot.errors import RobotRefused
from shearline.evaluator.robot.frames import apart, pose
from shearline.evaluator.robot.port import Array
from shearline.evaluator.robot.store import Calibration

#: How often the lock is shown.
REPEATS = 5

#: Largest distance and angle of one repeat from the mean of all.
SPREAD_M = 0.3e-3
SPREAD_RAD = math.radians(0.3)

#: Repeats closer than this to each other were not shown anew [m].
SAME_M = 1e-7


def mean_pose(poses: Array) -> Array:
    """Return the mean of poses ``(n, 4, 4)``: of positions, and the rotation nearest to the mean.

    The latter is the polar factor of the mean matrix (Moakher 2002, projected arithmetic mean).
    """
    left, _, right = np.linalg.svd(poses[:, :3, :3].mean(axis=0))
    sign = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    return pose(poses[:, :3, 3].mean(axis=0), left @ sign @ right)


def calibrated(poses: Array, tool: ToolTable, seated_m: float) -> Calibration:
    """Return the lock's pose from what the hand showed.

    Args:
        poses: Of the tip while the key sat in the lock ``(n, 4, 4)``.
        tool: What hung on the flange.
        seated_m: How deep the tip is then [m].

    Raises:
        RobotRefused: If the repeats do not agree, or are one and the same.
    """
    if len(poses) < REPEATS:
        raise RobotRefused(f"the lock was shown {len(poses)} times: show it {REPEATS} times")
    mean = mean_pose(poses)
    off = [apart(mean, one) for one in poses]
    spread_m, spread_rad = max(m for m, _ in off), max(rad for _, rad in off)
    if spread_m > SPREAD_M or spread_rad > SPREAD_RAD:
        raise RobotRefused(
            f"the repeats are up to {spread_m * 1e3:.2f} mm and {math.degrees(spread_rad):.2f} deg"
            f" off their mean, more than {SPREAD_M * 1e3:g} mm and"
            f" {math.degrees(SPREAD_RAD):g} deg: clamp the lock, seat the key and show it again"
        )
    if spread_m < SAME_M:
        raise RobotRefused("all repeats are the same pose: take the key out between them")
    mouth = mean @ pose((0.0, 0.0, -seated_m), np.eye(3))
    return Calibration(
        o_t_lock=tuple(mouth.ravel().tolist()),
        spread_m=spread_m,
        spread_rad=spread_rad,
        repeats=len(poses),
        at=time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        tool=tool,
        seated_m=seated_m,
    )
