"""What an operator does without a learner: look without moving, hover, show where the lock is."""

from __future__ import annotations

from queue import SimpleQueue
from typing import Any

import numpy as np

from shearline.evaluator.robot.bounds import Bounds
from shearline.evaluator.robot.calibration import REPEATS, calibrated
from shearline.evaluator.robot.errors import MotionEnded, RobotRefused
from shearline.evaluator.robot.frames import apart, in_lock
from shearline.evaluator.robot.pipe import Over
from shearline.evaluator.robot.port import Array, RobotPort
from shearline.evaluator.robot.results import Task
from shearline.evaluator.robot.store import Store
from shearline.evaluator.robot.terminal import Closed, Line, Terminal
from shearline.evaluator.robot.trial import Insertion, Report, Work, must_be_free, to_start
from shearline.evaluator.robot.watch import Watch

#: Share of the lab's speeds while hovering.
HOVER_PACE = 0.2

#: The arm stands while the hand shows a pose: no joint is faster [rad/s or m/s].
STILL = 0.02


def dry_run(
    port: RobotPort, bounds: Bounds, store: Store, terminal: Terminal, o_t_lock: Array
) -> Over:
    """Say what would happen; nothing moves, nothing is armed."""
    sample = Watch(port).look()
    start = in_lock(o_t_lock, (0.0, 0.0, -bounds.start.gap_m), (0.0, 0.0, 0.0))
    off_m, off_rad = apart(start, sample.o_t_ee)
    inside = bool(
        ((start[:3, 3] > bounds.guard.lowest_m) & (start[:3, 3] < bounds.guard.highest_m)).all()
    )
    wear = store.wear().insertions
    limits = bounds.wear
    terminal.say(
        f"the robot is {sample.mode}, {off_m * 1e3:.1f} mm and {np.degrees(off_rad):.1f} deg"
        " off the start pose"
    )
    terminal.say(f"the key {'may be' if store.key_in_lock else 'is not'} in the lock")
    for name, most in ((limits.key, limits.key_insertions), (limits.lock, limits.lock_insertions)):
        terminal.say(f"{name}: {wear.get(name, 0)} of {most} insertions")
    c = bounds.contact
    terminal.say(
        f"contacts: at most {c.stiffness_max_npm * c.clip_m:g} N along each axis at rest,"
        f" references at {c.reference_hz:g} Hz and at most {c.reference_mps:g} m/s"
    )
    if not inside:
        raise RobotRefused(
            "the start pose is outside the lab's workspace: calibrate, or correct it"
        )
    return Over(code=0, why="dry run: nothing has moved")


def hover(
    port: RobotPort,
    bounds: Bounds,
    task: Task,
    terminal: Terminal,
    inbox: SimpleQueue[Any],
    o_t_lock: Array,
) -> Over:
    """Run one whole trial slowly in the air, away from the lock; it counts for nothing."""
    away = in_lock(o_t_lock, (0.0, 0.0, -bounds.start.hover_m), (0.0, 0.0, 0.0))
    terminal.say(
        f"hover: one trial {bounds.start.hover_m * 1e3:g} mm in front of the lock at"
        f" {HOVER_PACE:.0%} of the speed; type 'confirm'"
    )
    if _line(inbox) != "confirm":
        return Over(code=0, why="not confirmed: nothing has moved")
    p, limits = task.work(bounds.canary_tuple(), bounds, port.joints)
    work, report, watch = Work(p, limits, away, bounds, HOVER_PACE), Report(), Watch(port)
    try:
        must_be_free(watch, o_t_lock)
        port.set_guard(bounds.port_guard())
        watch.refresh()
        to_start(port, watch, work)
        insertion = Insertion(port, watch, work, report)
        insertion.approach()
        insertion.insert()
        port.move_free(work.start_pose(), bounds.start.speed_mps * HOVER_PACE)
    except MotionEnded as ended:
        port.stop()
        raise RobotRefused(f"the hover trial ended early: {ended}") from None
    return Over(code=0, why=f"hover trial: {task.verdict(report)}; it counts for nothing")


def calibrate(
    port: RobotPort, bounds: Bounds, store: Store, terminal: Terminal, inbox: SimpleQueue[Any]
) -> Over:
    """Have the operator show the lock by hand; the arm moves nothing by itself.

    Raises:
        RobotRefused: If the repeats do not agree, or the terminal is gone.
    """
    terminal.say("calibration: lead the arm by hand until the key sits in the lock, and let go")
    poses: list[Array] = []
    watch = Watch(port)
    while len(poses) < REPEATS:
        terminal.say(f"repeat {len(poses) + 1} of {REPEATS}: type 'here' when it sits and is still")
        word = _line(inbox)
        if word is None or word == "quit":
            raise RobotRefused("the calibration was given up: the one before stays")
        if word != "here":
            continue
        try:
            sample = watch.look()
        except MotionEnded as lie:
            terminal.say(f"{lie}: nothing was taken")
            continue
        if np.abs(sample.dq).max() > STILL:
            terminal.say("the arm still moves: let go, wait, and type 'here' again")
            continue
        poses.append(sample.o_t_ee.copy())
    found = calibrated(np.array(poses), bounds.tool, bounds.lock.seated_m)
    store.set_calibration(found)
    store.note("calibrated", spread_mm=found.spread_m * 1e3, bounds=bounds.hash)
    spread = f"{found.spread_m * 1e3:.3f} mm and {np.degrees(found.spread_rad):.3f} deg"
    return Over(code=0, why=f"calibrated: {REPEATS} repeats within {spread} of their mean")


def _line(inbox: SimpleQueue[Any]) -> str | None:
    """Return the next line typed, ``None`` when nobody can type any more."""
    while True:
        item = inbox.get()
        if isinstance(item, Line):
            return item.text
        if isinstance(item, Closed):
            return None
