"""What a real lab varies from trial to trial, and the keys it has: switches behind a level's name.

``keylock+grasp+noise`` is the level ``keylock`` with two of them. A level's own name says nothing
of this: the plain levels are what they are without. Imports no engine and no compiler.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from shearline.protocol.errors import ConfigError


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
        grip_m: Standard deviation, clipped at 2, of the key's shift in the fingers along its
            height and its length [m]; the fingers close on it and so centre its thickness.
        grip_rad: The same of its turn about the line from finger to finger [rad].
        pad_factor: The fingers' pads give, with a stiffness up to this factor from its nominal
            value either way, uniform in its logarithm; 0: they are rigid.
        bias_nm: Standard deviation, clipped at 2, of each joint torque's constant error [N m].
        noise_nm: Of what is added to it in each tick of 1 ms [N m].
        key: Which of :data:`shearline.sims.lock.KEYS`; the lock is cut for it.
    """

    offset_m: float
    tilt_rad: float
    torque_big: float
    torque_small: float
    friction: tuple[float, float] | None = None
    pin_spread: float = 0.0
    grip_m: float = 0.0
    grip_rad: float = 0.0
    pad_factor: float = 0.0
    bias_nm: float = 0.0
    noise_nm: float = 0.0
    key: str = "a"

    @property
    def holds_rigidly(self) -> bool:
        """Whether the key is one piece with the hand."""
        return not (self.grip_m or self.grip_rad or self.pad_factor)


LEVELS: Mapping[str, Level] = MappingProxyType(
    {
        "keylock": Level(0.3e-3, math.radians(0.5), 40.0, 12.0),
        "keylock-limit": Level(0.3e-3, math.radians(0.5), 26.0, 7.8),
        "keylock-jam": Level(0.4e-3, math.radians(0.75), 26.0, 7.8, (0.15, 0.4), 0.3),
    }
)

#: Switch to what it changes, in the order in which a name lists them.
SWITCHES: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        # Brass on brass or steel, from lubricated to dry (tables give .15 to .5).
        "friction": {"friction": (0.15, 0.4)},
        # Springs of this size are sold with a tolerance of 10 to 15 % on rate and on length each.
        "pins": {"pin_spread": 0.3},
        # Twice the arm's repeatability of .1 mm (ISO 9283, the maker's figure): the key was put
        # down and picked up. The turn is an assumption: .3 mm at the tip, as much as the lock's.
        "grasp": {"grip_m": 0.2e-3, "grip_rad": math.radians(0.5)},
        # From 30 to 60 Shore A Young's modulus rises fourfold (Gent 1958).
        "pads": {"pad_factor": 2.0},
        # Joint friction of this arm is .3 to 1.3 N m (Gaz et al. 2019, its model's steps): half
        # of the least may be left over. The noise is an assumption, .04 N m behind the filter.
        "noise": {"bias_nm": 0.15, "noise_nm": 0.2},
        "key-b": {"key": "b"},
        "key-c": {"key": "c"},
    }
)

#: What a level with switches says of itself beyond the plain ones, by option.
_SAID = ("grip_m", "grip_rad", "pad_factor", "bias_nm", "noise_nm", "key")


def canonical(name: str) -> str:
    """Return a task's name with its switches in the one order that everyone uses.

    Raises:
        ConfigError: If the level or a switch is unknown, or changes nothing.
    """
    base, *switches = name.split("+")
    _apply(base, switches)
    return "+".join([base, *(switch for switch in SWITCHES if switch in switches)])


def level(name: str) -> Level:
    """Return the level called ``name``, e.g. ``"keylock"`` or ``"keylock+grasp+noise"``.

    Raises:
        ConfigError: If there is none, or a switch is unknown or changes nothing.
    """
    base, *switches = name.split("+")
    return _apply(base, switches)


def is_keylock(name: str) -> bool:
    """Tell whether a name is, or is meant to be, a level with or without switches."""
    return name.split("+", maxsplit=1)[0] in LEVELS


def said(chosen: Level) -> dict[str, str | float | bool]:
    """Return what switches decide as options of the task."""
    low, high = chosen.friction or (0.0, 0.0)
    return {
        "friction_low": low,
        "friction_high": high,
        **{name: getattr(chosen, name) for name in _SAID},
    }


def _apply(base: str, switches: list[str]) -> Level:
    if base not in LEVELS:
        raise ConfigError(f"no key-in-lock level {base!r}: expected one of {', '.join(LEVELS)}")
    chosen = LEVELS[base]
    if len(set(switches)) < len(switches):
        raise ConfigError(f"a switch was given twice: {'+'.join([base, *switches])}")
    for switch in switches:
        if switch not in SWITCHES:
            raise ConfigError(f"no switch {switch!r}: expected some of {', '.join(SWITCHES)}")
        changed = {name: getattr(chosen, name) for name in SWITCHES[switch]}
        if changed == SWITCHES[switch]:
            raise ConfigError(f"{base} has {switch} already: leave '+{switch}' out")
        if changed != {name: getattr(LEVELS[base], name) for name in changed}:
            raise ConfigError(f"a lock has one key, got {' and '.join(switches)}: choose one")
        chosen = replace(chosen, **SWITCHES[switch])
    return chosen
