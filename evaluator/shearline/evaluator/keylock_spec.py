"""What the key-in-lock task is, for hosts that never run it.

The :class:`~shearline.protocol.task.TaskSpec` that learner and evaluator compare, and the numbers
of the task that no level changes. Imports no engine and no compiler.
"""

from __future__ import annotations

from shearline.evaluator.keylock_variation import canonical, level, said
from shearline.evaluator.skill.parameters import BOUNDS
from shearline.protocol.task import TaskSpec

#: Raised whenever the skill, the cost or the scene changes what a tuple costs.
SKILL_VERSION = 1

#: Depth of the tip that counts as inserted [m].
DEPTH_M = 24.5e-3

#: g of eq. (6): a total failure costs 5 s + 400 s/m * 24.5 mm = 14.8, as in the paper [s/m].
COST_PER_M = 400.0

#: Radius of the region of interest [m].
ROI_M = 5e-3

#: Longest wall time of one trial before it counts as hung [s].
TRIAL_S = 60.0


def keylock_spec(name: str = "keylock") -> TaskSpec:
    """Return the task as both sides must mean it.

    Args:
        name: A level, with or without switches, e.g. ``"keylock-limit+grasp+noise"``.

    Raises:
        ConfigError: If there is no such level, or a switch is unknown or changes nothing.
    """
    name, chosen = canonical(name), level(name)
    options: dict[str, str | float | bool] = {
        "level": name,
        "skill": float(SKILL_VERSION),
        "depth_m": DEPTH_M,
        "cost_per_m": COST_PER_M,
        "roi_m": ROI_M,
        "offset_m": chosen.offset_m,
        "tilt_rad": chosen.tilt_rad,
        "torque_big": chosen.torque_big,
        "torque_small": chosen.torque_small,
        "pin_spread": chosen.pin_spread,
    }
    if "+" in name:
        options |= said(chosen)
    return TaskSpec(name=name, space=dict(BOUNDS), options=options, trial_s=TRIAL_S)
