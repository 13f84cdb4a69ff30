"""The whole skill on both Frankas: real client, emulated robot, the lock with its pins."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from emulator.kit import Kind, tool
from emulator.process import Emulator

from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.robot.bounds import Bounds, read_bounds
from shearline.evaluator.robot.errors import MotionEnded
from shearline.evaluator.robot.frames import pose
from shearline.evaluator.robot.ladder import extract
from shearline.evaluator.robot.log import missing
from shearline.evaluator.robot.trial import Insertion, Report, Work, to_start
from shearline.evaluator.robot.watch import Watch
from shearline.evaluator.skill import semantic
from shearline.evaluator.skill.parameters import parameters
from shearline.sims.scene import believed_lock_pose

LAB = Path(__file__).parents[3] / "docs" / "examples" / "lab.toml"


@pytest.fixture(scope="module")
def task() -> KeylockTask:
    task = KeylockTask()
    task.warm()
    return task


def work(task: KeylockTask, lab: Bounds) -> Work:
    """Return a trial of the lab's canary."""
    space = task.spec.space
    named = {name: (space[name][1] + space[name][2]) / 2.0 for name in space}
    theta = np.array(list((named | dict(lab.canary.theta)).values()))
    believed = believed_lock_pose()
    o_t_lock = pose(believed.position, believed.rotation)
    return Work(parameters(theta), task.limits(), o_t_lock, lab)


def trial(kind: Kind, robot: Emulator, task: KeylockTask, seed: int) -> tuple[Report, Any]:
    """Run one trial, pull the key out, and return its report and the log."""
    lab = read_bounds(LAB)
    robot.order(f"place {seed}")
    port = kind.led(robot.address)
    port.open(tool())
    try:
        port.set_guard(lab.port_guard())
        watch, report, job = Watch(port), Report(), work(task, lab)
        to_start(port, watch, job)
        insertion = Insertion(port, watch, job, report)
        insertion.approach()
        insertion.insert()
        assert extract(port, watch, job, report)
        return report, port.drain_log()
    finally:
        port.close()


@pytest.mark.slow
def test_a_tuple_that_opens_the_lock_in_simulation_opens_it_through_the_real_client(
    kind: Kind, robot: Emulator, task: KeylockTask
) -> None:
    report, log = trial(kind, robot, task, seed=1)
    assert report.end.verdict == semantic.SUCCESS
    assert report.end.depth_m > 0.024
    assert missing(log, report.stretches) == 0
    assert robot.report()["lost"] == 0
    assert robot.report()["depth_m"] < 0.0, "the key is out again"


@pytest.mark.bench
@pytest.mark.long
def test_twenty_trials(kind: Kind, robot: Emulator, task: KeylockTask) -> None:
    """Print how long they take; on the first, the compiled layers are loaded."""
    begun, robot_s, opened, aborted = time.monotonic(), 0.0, 0, 0
    for seed in range(20):
        try:
            report, log = trial(kind, robot, task, seed)
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
