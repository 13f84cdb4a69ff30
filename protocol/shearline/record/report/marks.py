"""Path data of SVG for what pictures are made of: dots, lines, steps, bands, bars.

All coordinates are shares of the plane, 0 to 1, x to the right and y **up**; in a path they are
whole thousandths, y down. The plane is stretched to whatever room there is, so that strokes keep
their width and dots, which are strokes without length, stay round.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

#: Units of the plane along each side.
SIDE = 1000

Shares = npt.ArrayLike


def dots(x: Shares, y: Shares) -> str:
    """Return one dot for each point."""
    return "".join(f"M{px} {py}h0" for px, py in _points(x, y))


def line(x: Shares, y: Shares) -> str:
    """Return one line through all points."""
    points = _points(x, y)
    return "M" + "L".join(f"{px} {py}" for px, py in points) if points else ""


def steps(x: Shares, y: Shares) -> str:
    """Return a line that keeps its height until the next point."""
    points = _points(x, y)
    if not points:
        return ""
    (first_x, first_y), *rest = points
    return f"M{first_x} {first_y}" + "".join(f"H{px}V{py}" for px, py in rest)


def band(x: Shares, low: Shares, high: Shares) -> str:
    """Return the area between two lines over the same x."""
    up, down = _points(x, high), _points(x, low)[::-1]
    return "M" + "L".join(f"{px} {py}" for px, py in up + down) + "Z" if up else ""


def bars(left: Shares, right: Shares, low: Shares, high: Shares) -> str:
    """Return one upright bar for each ``(left, right, low, high)``."""
    corners = zip(_points(left, high), _points(right, low), strict=True)
    return "".join(f"M{x0} {y0}H{x1}V{y1}H{x0}Z" for (x0, y0), (x1, y1) in corners)


def uprights(x: Shares, low: Shares, high: Shares) -> str:
    """Return one upright line for each ``(x, low, high)``."""
    ends = zip(_points(x, low), _points(x, high), strict=True)
    return "".join(f"M{x0} {y0}V{y1}" for (x0, y0), (_, y1) in ends)


def grid(columns: Iterable[float], rows: Iterable[float]) -> str:
    """Return lines all across the plane."""
    upright = "".join(f"M{round(SIDE * x)} 0V{SIDE}" for x in columns)
    return upright + "".join(f"M0 {SIDE - round(SIDE * y)}H{SIDE}" for y in rows)


def _points(x: Shares, y: Shares) -> list[tuple[str, str]]:
    across, up = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (x, y)))
    xs = np.round(SIDE * np.atleast_1d(across), 1).tolist()
    ys = np.round(SIDE * (1.0 - np.atleast_1d(up)), 1).tolist()
    return [(f"{px:g}", f"{py:g}") for px, py in zip(xs, ys, strict=True)]
