"""Where a function on a grid is positive, as an area: marching squares in closed form.

Knows numbers only. Cells that lie wholly inside are joined to runs, so that the path stays short.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Point = tuple[float, float]


def positive(values: Array) -> list[list[Point]]:
    """Return polygons that together cover where a bilinear surface is at least 0.

    Args:
        values: On a regular grid ``(columns, rows)``, at least 2 by 2.

    Returns:
        Polygons of ``(x, y)``, both 0 to 1 over the grid; they do not overlap.
    """
    columns, rows = values.shape
    polygons: list[list[Point]] = []
    inside = values >= 0.0
    whole = inside[:-1, :-1] & inside[1:, :-1] & inside[:-1, 1:] & inside[1:, 1:]
    none = ~(inside[:-1, :-1] | inside[1:, :-1] | inside[:-1, 1:] | inside[1:, 1:])
    for j in range(rows - 1):
        for first, last in _runs(whole[:, j]):
            polygons.append([(first, j), (last, j), (last, j + 1), (first, j + 1)])
        mixed = np.flatnonzero(~whole[:, j] & ~none[:, j])
        polygons += [[point for point, _ in _walk(values, int(i), j)] for i in mixed]
    scale = (1.0 / (columns - 1), 1.0 / (rows - 1))
    return [[(x * scale[0], y * scale[1]) for x, y in polygon] for polygon in polygons]


def zero(values: Array) -> list[tuple[Point, Point]]:
    """Return the pieces of the line on which the surface is 0; see :func:`positive`."""
    columns, rows = values.shape
    pieces = []
    for i in range(columns - 1):
        for j in range(rows - 1):
            pieces += _pieces([found for found in _walk(values, i, j) if found[1] != "corner"])
    scale = (1.0 / (columns - 1), 1.0 / (rows - 1))
    return [
        ((a[0] * scale[0], a[1] * scale[1]), (b[0] * scale[0], b[1] * scale[1])) for a, b in pieces
    ]


def _walk(values: Array, i: int, j: int) -> Iterator[tuple[Point, str]]:
    """Go round a cell and yield its inside corners and its crossings, in order."""
    corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
    for here, there in zip(corners, corners[1:] + corners[:1], strict=True):
        a, b = float(values[here]), float(values[there])
        if a >= 0.0:
            yield (float(here[0]), float(here[1])), "corner"
        if (a >= 0.0) != (b >= 0.0):
            t = a / (a - b)
            at = (here[0] + t * (there[0] - here[0]), here[1] + t * (there[1] - here[1]))
            yield at, "leave" if a >= 0.0 else "enter"


def _pieces(crossed: list[tuple[Point, str]]) -> list[tuple[Point, Point]]:
    """Join where the way round a cell leaves the area to where it enters it again."""
    if crossed and crossed[0][1] == "enter":
        crossed = crossed[1:] + crossed[:1]
    return [(a, b) for (a, _), (b, _) in zip(crossed[::2], crossed[1::2], strict=True)]


def _runs(flags: npt.NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield ``(first, last + 1)`` of each run of true cells."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        yield int(first), int(last)
