"""The whole skill on both Frankas: real client, emulated robot, the lock with its pins."""

from __future__ import annotations

import time

import pytest
from emulator.compare import LAB, insert
from emulator.kit import Kind
from emulator.process import Emulator

from shearline.evaluator.robot.bounds import read_bounds
from shearline.evaluator.robot.errors import MotionEnded
from shearline.evaluator.robot.log import missing
from shearline.evaluator.robot.port import Array
from shearline.evaluator.robot.trial import Report
from shearline.evaluator.skill import semantic


def trial(kind: Kind, robot: Emulator, seed: int) -> tuple[Report, Array]:
    """Run one trial of the lab's canary, pull the key out, and return its report and the log."""
    lab = read_bounds(LAB)
    return insert(kind, robot, lab.canary_tuple(), lab, f"place {seed}")


@pytest.mark.slow
def test_a_tuple_that_opens_the_lock_in_simulation_opens_it_through_the_real_client(
    kind: Kind, robot: Emulator
) -> None:
    report, log = trial(kind, robot, seed=1)
    assert report.end.verdict == semantic.SUCCESS
    assert report.end.depth_m > 0.024
    assert missing(log, report.stretches) == 0
    assert robot.report()["lost"] == 0
    assert robot.report()["depth_m"] < 0.0, "the key is out again"


@pytest.mark.bench
@pytest.mark.long
def test_twenty_trials(kind: Kind, robot: Emulator) -> None:
    """Print how long they take; on the first, the compiled layers are loaded."""
    begun, robot_s, opened, aborted = time.monotonic(), 0.0, 0, 0
    for seed in range(20):
        try:
            report, log = trial(kind, robot, seed)
        except MotionEnded as ended:  # a machine so crowded that Python was away for too long
            print(f"trial {seed}: {ended}")  # noqa: T201
            aborted += 1
            continue
        robot_s += float(log[-1, 0] - log[0, 0])
        opened += report.end.verdict == semantic.SUCCESS
        assert missing(log, report.stretches) == 0
    wall_s = time.monotonic() - begun
    print(  # noqa: T201
        f"{kind.name}: {wall_s:.1f} s wall, {robot_s:.1f} s robot,"
        f" {opened} of 20 opened, {aborted} aborted"
    )
    assert opened > 0
