"""The skill: the three layers, one on top of the other, for one tick.

Knows no plant: whoever has a :class:`~shearline.sims.plant.Percept` can run it, from a compiled
loop or from Python.
"""

from __future__ import annotations

from typing import NamedTuple

from shearline.evaluator.skill.control import Arm, Feel, control, empty_feel, feel
from shearline.evaluator.skill.manipulation import APPROACH_S, Command, command, empty_command
from shearline.evaluator.skill.parameters import Parameters
from shearline.evaluator.skill.semantic import Decision, Limits, Sight, decide
from shearline.sims.compiled import compiled
from shearline.sims.plant import Percept, empty_percept


class State(NamedTuple):
    """What the layers remember and say; the arrays inside are filled in place."""

    percept: Percept
    feel: Feel
    command: Command


def empty_state() -> State:
    """Return the state before the first tick."""
    return State(empty_percept(), empty_feel(), empty_command())


@compiled
def tick(
    state: State, before: Decision, p: Parameters, limits: Limits, arm: Arm, tick_s: float
) -> Decision:
    """Run the three layers once; ``state.percept`` must be fresh.

    Args:
        state: Changed in place; ``state.feel.tau (7,)`` [N m] is what the arm is to do.
        before: Where the skill stood.
        p: The tuple being tried.
        limits: What the trial must not exceed.
        arm: Constants of the arm.
        tick_s: Length of a tick [s].

    Returns:
        Where the skill stands now.
    """
    percept, f, c = state.percept, state.feel, state.command
    if before.phase_ticks < 0:
        f.tau[:] = percept.bias
    feel(f, percept, arm)
    sight = Sight(
        percept.in_lock[0], percept.in_lock[1], percept.in_lock[2], -f.wrench[2], APPROACH_S
    )
    now = decide(before, sight, f.tau_ext, p, limits, tick_s)
    command(c, now.phase, now.phase_ticks, f.tip, f.speed[2], p, tick_s)
    control(f, percept, c, arm)
    return now
