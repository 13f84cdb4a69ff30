"""Axes as values: where a number lies between two ends, and which numbers deserve a tick."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: An axis of positive values is logarithmic when the highest is this often the lowest tenth.
DECADES_RATIO = 20.0

#: Below this, and above its inverse, there is no room left beside a value on a logarithmic axis.
LOG_MIN = 1e-250


@dataclass(frozen=True, slots=True)
class Scale:
    """One axis.

    Attributes:
        low: Value at its beginning; positive if logarithmic.
        high: Value at its end; above ``low``.
        log: Whether equal steps are equal factors.
    """

    low: float
    high: float
    log: bool = False

    def place(self, values: npt.ArrayLike) -> Array:
        """Return where values lie, 0 at the beginning and 1 at the end, and not beyond."""
        v = np.asarray(values, dtype=np.float64)
        if self.log:
            low = math.log(self.low)  # a quotient of two values may be beyond all numbers
            shares = (np.log(np.maximum(v, self.low)) - low) / (math.log(self.high) - low)
        else:
            shares = (v - self.low) / (self.high - self.low)
        return np.clip(shares, 0.0, 1.0)

    def ticks(self, about: int = 5) -> list[float]:
        """Return round values within the axis, about so many."""
        return _decades(self.low, self.high, about) if self.log else _steps(self, about)


def holding(values: npt.ArrayLike, *, zero: bool = False, log: bool = False) -> Scale:
    """Return an axis that holds all finite values with a little room, from zero if asked.

    With ``log`` it is logarithmic if the values are positive and spread over decades.
    """
    v = np.asarray(values, dtype=np.float64).ravel()
    v = v[np.isfinite(v)]
    if not v.size:
        return Scale(0.0, 1.0)
    low, high = float(v.min()), float(v.max())
    can_log = log and low > LOG_MIN and high < 1.0 / LOG_MIN
    if can_log and high > DECADES_RATIO * np.quantile(v, 0.1):
        room = math.exp(0.04 * (math.log(high) - math.log(low)))
        return Scale(low / room, high * room, log=True)
    if zero and low >= 0.0:
        return Scale(0.0, high * 1.05 if high > 0.0 else 1.0)
    room = 0.05 * (high - low) or max(abs(high), 1e-9) * 0.5
    return Scale(low - room, high + room)


def _steps(scale: Scale, about: int) -> list[float]:
    raw = (scale.high - scale.low) / max(about, 1)
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(s for s in (1.0, 2.0, 5.0, 10.0) if s * power >= raw * 0.999) * power
    first = math.ceil(scale.low / step - 1e-9)
    last = math.floor(scale.high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def _decades(low: float, high: float, about: int) -> list[float]:
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for factors in ((1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
        ticks = [f * 10.0**p for p in powers for f in factors]
        inside = [tick for tick in ticks if low <= tick <= high]
        if len(inside) <= about + 2:
            return inside
    return inside[:: -(-len(inside) // about)]
