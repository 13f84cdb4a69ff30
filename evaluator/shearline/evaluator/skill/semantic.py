"""The semantic layer: may the skill start, which phase is it in, has it succeeded or failed.

It reads what the lower layers report (:class:`Sight`) and decides; it commands nothing and knows
no plant. The clock of the cost is geometry: it starts when the tip crosses the mouth plane of the
lock, in whatever phase that happens, so that no parameter can move it. All functions are pure and
run alike in compiled loops and in Python.
"""

from __future__ import annotations

from typing import NamedTuple

from shearline.evaluator.skill.parameters import Parameters
from shearline.sims.compiled import compiled
from shearline.sims.panda import Array

# Phases of the skill; plain integers, because they live in compiled loops and in traces.
APPROACH = 0
CONTACT = 1
INSERTION = 2
EXTRACTION = 3
END = 4

PHASES = ("approach", "contact", "insertion", "extraction", "end")

# How the skill ended.
OPEN = 0
SUCCESS = 1
TORQUE = 2
ROI = 3
TIME = 4
SEARCH = 5

#: Names of the verdicts; a success has no failure name.
VERDICTS = ("open", "", "torque", "roi", "time", "search")

#: Seconds that the tip may be in the lock, and that a failure is charged [s].
TIME_MAX_S = 5.0

#: Seconds from the first contact phase until the tip must have crossed the mouth plane [s].
SEARCH_MAX_S = 5.0

#: The approach has arrived when its trajectory has ended this long ago [s].
SETTLE_S = 0.15

#: The extraction ends when the tip is this far in front of the mouth [m], or after its time [s].
CLEAR_M = 2e-3
EXTRACTION_MAX_S = 1.5


class Limits(NamedTuple):
    """What the trial must not exceed.

    Attributes:
        torque: Largest external torque of each joint, low-passed ``(7,)`` [N m].
        roi_m: Radius of the region of interest around the axis of the lock [m].
        depth_m: Depth of the tip that counts as inserted [m].
        cost_per_m: Charge for each metre that is missing at the end, g of eq. (6) [s/m].
    """

    torque: Array
    roi_m: float
    depth_m: float
    cost_per_m: float


class Sight(NamedTuple):
    """What the semantic layer sees of one tick.

    Attributes:
        x_m: Tip in the frame of the lock [m].
        y_m: As above.
        depth_m: As above, along z.
        push_n: Force with which the lock pushes back along its axis, low-passed [N].
        approach_s: Duration of the approach trajectory [s].
    """

    x_m: float
    y_m: float
    depth_m: float
    push_n: float
    approach_s: float


class Decision(NamedTuple):
    """Where the skill stands.

    Attributes:
        phase: One of the phases.
        phase_ticks: Ticks spent in it.
        search_ticks: Ticks since the contact phase began.
        clock_ticks: Ticks since the tip first crossed the mouth plane, -1 before; stops with the
            verdict.
        verdict: One of the verdicts.
        depth_m: Depth of the tip at the verdict [m].
    """

    phase: int
    phase_ticks: int
    search_ticks: int
    clock_ticks: int
    verdict: int
    depth_m: float


@compiled
def beginning() -> Decision:
    """Return where every trial stands before its first tick."""
    return Decision(APPROACH, -1, 0, -1, OPEN, 0.0)


@compiled
def may_start(tip_depth_m: float, lateral_m: float, tau_ext: Array, limits: Limits) -> bool:
    """Tell whether the preconditions hold.

    The key must be in front of the lock, within the region of interest, and free: a key that is
    still in the lock from the trial before would otherwise count as inserted at no cost.
    """
    free = True
    for j in range(tau_ext.shape[0]):
        free = free and abs(tau_ext[j]) < 0.25 * limits.torque[j]
    return free and tip_depth_m < -CLEAR_M and lateral_m < limits.roi_m


@compiled
def decide(
    before: Decision, sight: Sight, tau_ext: Array, p: Parameters, limits: Limits, tick_s: float
) -> Decision:
    """Return where the skill stands after one more tick.

    The region of interest counts from the contact phase on: the approach is in free space.

    Args:
        before: Where it stood.
        sight: What is seen now.
        tau_ext: External torque, low-passed ``(7,)`` [N m].
        p: The tuple being tried.
        limits: What the trial must not exceed.
        tick_s: Length of a tick [s].
    """
    if before.verdict != OPEN:
        return _after_verdict(before, sight, tick_s)
    inside = before.clock_ticks >= 0 or sight.depth_m >= 0.0
    clock = before.clock_ticks + 1 if inside else -1
    search = before.search_ticks + 1 if before.phase != APPROACH else 0
    verdict = _verdict(sight, tau_ext, limits, clock * tick_s, search * tick_s)
    if verdict != OPEN:
        return Decision(EXTRACTION, 0, search, clock, verdict, sight.depth_m)
    phase = _next_phase(before, sight, p, tick_s)
    ticks = before.phase_ticks + 1 if phase == before.phase else 0
    return Decision(phase, ticks, search, clock, OPEN, sight.depth_m)


@compiled
def _next_phase(before: Decision, sight: Sight, p: Parameters, tick_s: float) -> int:
    if before.phase == APPROACH and before.phase_ticks * tick_s >= sight.approach_s + SETTLE_S:
        return CONTACT
    if before.phase == CONTACT and sight.push_n >= p.con_force:
        return INSERTION
    return before.phase


@compiled
def _verdict(sight: Sight, tau_ext: Array, limits: Limits, clock_s: float, search_s: float) -> int:
    searching = search_s > 0.0
    for j in range(tau_ext.shape[0]):
        if abs(tau_ext[j]) > limits.torque[j]:
            return TORQUE
    if searching and sight.x_m**2 + sight.y_m**2 > limits.roi_m**2:
        return ROI
    if sight.depth_m >= limits.depth_m:
        return SUCCESS
    if clock_s >= TIME_MAX_S:
        return TIME
    if clock_s < 0.0 and search_s >= SEARCH_MAX_S:
        return SEARCH
    return OPEN


@compiled
def _after_verdict(before: Decision, sight: Sight, tick_s: float) -> Decision:
    ticks = before.phase_ticks + 1
    done = sight.depth_m < -CLEAR_M or ticks * tick_s >= EXTRACTION_MAX_S
    phase = END if before.phase == END or done else EXTRACTION
    return Decision(
        phase,
        ticks,
        before.search_ticks,
        before.clock_ticks,
        before.verdict,
        before.depth_m,
    )


@compiled
def cost(end: Decision, limits: Limits, tick_s: float) -> float:
    """Return eq. (6) of the paper: the integral of 1 dt over the insertion, plus g dz [s].

    A failure is charged the full time, or an early one would be a cheap one. dz is the distance
    from the tip to the target depth, at most the whole depth.
    """
    missing_m = min(max(limits.depth_m - end.depth_m, 0.0), limits.depth_m)
    time_s = end.clock_ticks * tick_s if end.verdict == SUCCESS else TIME_MAX_S
    return time_s + limits.cost_per_m * missing_m
