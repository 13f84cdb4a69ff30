"""Numbers as people write them: few digits, units, shares, durations, intervals."""

from __future__ import annotations

import math

#: A minus sign, as long as a plus.
MINUS = "\N{MINUS SIGN}"
#: Between a number and its unit: the two are not parted by a line's end.
THIN = "\N{NARROW NO-BREAK SPACE}"
#: Where there is nothing to say.
NOTHING = "\N{EN DASH}"


def number(value: float | None, digits: int = 3) -> str:
    """Write a number with so many significant digits; powers of ten only where they must be."""
    if value is None or not math.isfinite(value):
        return NOTHING
    text = f"{value:.{digits}g}"
    if "e" in text:
        if 1.0 <= abs(value) < 1e6:
            text = f"{value:.0f}"
        else:
            mantissa, power = text.split("e")
            text = f"{mantissa}e{int(power)}"
    return text.replace("-", MINUS)


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """Write a number with its unit."""
    text = number(value, digits)
    return f"{text}{THIN}{unit}" if unit and text != NOTHING else text


def share(value: float | None) -> str:
    """Write a share, 0 to 1, as per cent."""
    return NOTHING if value is None or not math.isfinite(value) else f"{100 * value:.0f}{THIN}%"


def between(low: float, high: float) -> str:
    """Write an interval of shares as per cent."""
    return f"{100 * low:.0f} to {100 * high:.0f}{THIN}%"


def duration(time_s: float) -> str:
    """Write a time that something took: ``"0.54 s"``, ``"4 min 10 s"``, ``"2 h 5 min"``."""
    if not math.isfinite(time_s):
        return NOTHING
    if time_s < 100.0:
        return quantity(time_s, "s", 3 if time_s >= 10.0 else 2)
    minutes, rest_s = divmod(round(time_s), 60)
    if minutes < 100:
        return f"{minutes}{THIN}min {rest_s}{THIN}s"
    hours, rest = divmod(minutes, 60)
    return f"{hours}{THIN}h {rest}{THIN}min"


def count(n: int, one: str, many: str | None = None) -> str:
    """Write how many there are: ``"1 trial"``, ``"2 trials"``."""
    return f"{n} {one if n == 1 else many or one + 's'}"
