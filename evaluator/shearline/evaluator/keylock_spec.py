"""What the key-in-lock task is, for hosts that never run it.

Levels, limits and noise as data, and the :class:`~shearline.protocol.messages.TaskSpec` that
learner and evaluator compare. Imports no engine and no compiler.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from shearline.evaluator.skill.parameters import BOUNDS
from shearline.protocol.errors import ConfigError
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


@dataclass(frozen=True, slots=True)
class Level:
    """How hard the task is.

    Attributes:
        offset_m: Standard deviation of the lock's true position, each axis, clipped at 2 [m].
        tilt_rad: The same of its rotation about each axis [rad].
        torque_big: Limit of the external torque on joints 1 to 4 [N m].
        torque_small: The same on joints 5 to 7 [N m].
        friction: Range of the friction coefficient, uniform; ``None``: the lock's own.
        pin_spread: Half range of the factor on each pin's spring, uniform.
    """

    offset_m: float
    tilt_rad: float
    torque_big: float
    torque_small: float
    friction: tuple[float, float] | None = None
    pin_spread: float = 0.0


LEVELS: dict[str, Level] = {
    "keylock": Level(0.3e-3, math.radians(0.5), 40.0, 12.0),
    "keylock-limit": Level(0.3e-3, math.radians(0.5), 26.0, 7.8),
    "keylock-jam": Level(0.4e-3, math.radians(0.75), 26.0, 7.8, (0.15, 0.4), 0.3),
}


def level(name: str) -> Level:
    """Return the level called ``name``.

    Raises:
        ConfigError: If there is none.
    """
    try:
        return LEVELS[name]
    except KeyError:
        raise ConfigError(
            f"no key-in-lock level {name!r}: expected one of {', '.join(LEVELS)}"
        ) from None


def keylock_spec(name: str = "keylock") -> TaskSpec:
    """Return the task as both sides must mean it.

    Raises:
        ConfigError: If there is no such level.
    """
    chosen = level(name)
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
    return TaskSpec(name=name, space=dict(BOUNDS), options=options, trial_s=TRIAL_S)
