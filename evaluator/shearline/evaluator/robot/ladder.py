"""The extraction ladder: how the key comes out, gently first.

Straight pull; pull with a wiggle the other way round; back to the axis and pull again. The gripper
stays closed all the way: a key that is let go of stays in the lock, and with it the knowledge of
where it is. What does not come out by then is for the operator's hands.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from shearline.evaluator.robot.errors import Ending, MotionEnded
from shearline.evaluator.robot.port import RobotPort
from shearline.evaluator.robot.reference import Reference, contact_of, target_of
from shearline.evaluator.robot.sight import Sight, View
from shearline.evaluator.robot.trial import Report, Work
from shearline.evaluator.robot.watch import Watch
from shearline.evaluator.skill.manipulation import Command, command, empty_command
from shearline.evaluator.skill.semantic import CLEAR_M, EXTRACTION, EXTRACTION_MAX_S

#: Wiggle of the second rung: forces [N], torques [N m] and frequency [Hz].
WIGGLE_N = 5.0
WIGGLE_NM = 0.3
WIGGLE_HZ = 2.0

#: How long the third rung leads the key back to the axis before it pulls [s].
CENTRE_S = 0.5

Rung = Callable[[Command, float], None]


def straight(_c: Command, _t_s: float) -> None:
    """Pull along the axis where the key is, as the skill does."""


def wiggled(c: Command, t_s: float) -> None:
    """Pull, and turn the Lissajous figure of an insertion the other way round."""
    turn = -2.0 * math.pi * WIGGLE_HZ * t_s
    c.wrench[0], c.wrench[1] = WIGGLE_N * math.sin(turn), WIGGLE_N * math.cos(turn)
    c.wrench[3], c.wrench[4] = WIGGLE_NM * math.sin(turn), WIGGLE_NM * math.cos(turn)


def centred(c: Command, t_s: float) -> None:
    """Lead position and tilt back to the axis of the lock while pulling."""
    left = max(0.0, 1.0 - t_s / CENTRE_S)
    c.x[:2] *= left
    c.turn[:] *= left


RUNGS: tuple[tuple[str, Rung, float], ...] = (
    ("straight pull", straight, EXTRACTION_MAX_S),
    ("reversed wiggle", wiggled, 2.0 * EXTRACTION_MAX_S),
    ("re-centred pull", centred, EXTRACTION_MAX_S + CENTRE_S),
)


def extract(port: RobotPort, watch: Watch, work: Work, report: Report) -> str:
    """Pull the key out.

    Returns:
        Name of the rung that freed it, or ``""`` if none did: the key is jammed.

    Raises:
        MotionEnded: If the robot stopped by itself, or was stopped.
    """
    for name, rung, most_s in RUNGS:
        if _climb(port, watch, work, report, rung, most_s):
            return name
    return ""


def is_clear(view: View) -> bool:
    """Tell whether the tip is out of the lock."""
    return bool(view.tip[2] < -CLEAR_M)


def _climb(
    port: RobotPort, watch: Watch, work: Work, report: Report, rung: Rung, most_s: float
) -> bool:
    """Try one rung; tell whether the key is out."""
    sight, c, reference = Sight(work.o_t_lock), empty_command(), Reference(work.bounds, work.pace)
    watch.refresh()
    view = sight.view(watch.look())
    if is_clear(view):
        return True
    _pull(c, view, 0, rung, work)
    with watch.blocked():
        session = port.contact(contact_of(c, work.o_t_lock, work.bounds, most_s / work.pace + 1.0))
    view = sight.view(watch.look())
    begin_s, tick = view.t_s, 0
    report.begun(view.t_s)
    reference.begin(view.tip, view.turn)
    try:
        while not is_clear(view) and view.t_s - begin_s < most_s / work.pace:
            tick += 1
            _pull(c, view, tick, rung, work)
            reference.toward(target_of(c, view.speed_z), view.tip, view.turn, work.tick_s)
            session.ref(reference.pose(work.o_t_lock))
            report.ran_until(view.t_s)
            view = sight.view(watch.until(view.t_s + work.tick_s))
            report.notes.append((view.t_s, EXTRACTION, c.x[0], c.x[1], *[0.0] * 5))
        with watch.blocked():
            session.end()
        report.ran_until(view.t_s)
    except MotionEnded as ended:
        if ended.ending not in {Ending.GUARD, Ending.TIME}:
            raise
    return is_clear(view)


def _pull(c: Command, view: View, tick: int, rung: Rung, work: Work) -> None:
    command(c, EXTRACTION, tick, view.tip, view.speed_z, work.p, work.tick_s)
    if tick == 0:
        c.turn[:] = np.asarray(view.turn)
    rung(c, tick * work.tick_s)
