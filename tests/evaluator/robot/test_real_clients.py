"""The whole skill on both Frankas: real client, emulated robot, the lock with its pins."""

from __future__ import annotations

import os
import statistics
import time

import pytest
from emulator.compare import LAB, insert
from emulator.kit import Kind
from emulator.process import Emulator

from shearline.evaluator.robot.bounds import read_bounds
from shearline.evaluator.robot.errors import MotionEnded
from shearline.evaluator.robot.log import missing
from shearline.evaluator.robot.port import LOG_STEP_S, Array
from shearline.evaluator.robot.trial import Report
from shearline.evaluator.skill import semantic

#: A trial of the canary takes no more of the robot's time than this, from the start pose to the key
#: out of the lock [s].
MOVED_S = 3.0


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
    """Print how long they take; on the first, the compiled layers are loaded.

    How much of the robot's time a trial takes is no matter of the machine, and has a limit.
    """
    begun, moved_s, opened, aborted = time.monotonic(), [], 0, 0
    for seed in range(20):
        try:
            report, log = trial(kind, robot, seed)
        except MotionEnded as ended:  # a machine so crowded that Python was away for too long
            print(f"trial {seed}: {ended}")  # noqa: T201
            aborted += 1
            continue
        moved_s.append(len(log) * LOG_STEP_S)
        opened += report.end.verdict == semantic.SUCCESS
        assert missing(log, report.stretches) == 0
    wall_s, all_s, load = time.monotonic() - begun, sum(moved_s), os.getloadavg()[0]
    print(  # noqa: T201
        f"{kind.name}: {wall_s:.1f} s wall at load {load:.1f}, {all_s:.1f} s of motion,"
        f" {all_s / wall_s:.2f} times real time, {opened} of 20 opened, {aborted} aborted"
    )
    assert statistics.median(moved_s) < MOVED_S
    assert opened + aborted >= 16, "the canary is known to work"
