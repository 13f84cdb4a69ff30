"""Areas and lines of a function on a grid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.record.report.contour import Point, positive, zero

SLOPE = st.floats(-3, 3)


def area(polygons: list[list[Point]]) -> float:
    total = 0.0
    for polygon in polygons:
        x, y = np.array(polygon).T
        total += 0.5 * abs(float(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))))
    return total


def plane(a: float, b: float, c: float, columns: int, rows: int) -> np.ndarray:
    x, y = np.linspace(0, 1, columns), np.linspace(0, 1, rows)
    return a * x[:, None] + b * y[None, :] + c


@given(SLOPE, SLOPE, SLOPE, st.integers(2, 7), st.integers(2, 7))
def test_a_plane_parts_the_square_into_what_is_inside_and_what_is_not(
    a: float, b: float, c: float, columns: int, rows: int
) -> None:
    values = plane(a, b, c, columns, rows)
    if np.any(values == 0.0):
        values += 1e-9
    assert area(positive(values)) + area(positive(-values)) == pytest.approx(1.0, abs=1e-9)


@given(SLOPE, SLOPE, SLOPE, st.integers(2, 7))
def test_the_line_is_where_a_plane_is_zero_and_polygons_where_it_is_not_less(
    a: float, b: float, c: float, side: int
) -> None:
    values = plane(a, b, c, side, side)
    for x, y in (point for piece in zero(values) for point in piece):
        assert a * x + b * y + c == pytest.approx(0.0, abs=1e-9)
    for x, y in (point for polygon in positive(values) for point in polygon):
        assert a * x + b * y + c >= -1e-9


def test_a_disc_has_its_area_and_its_rim() -> None:
    side = np.linspace(-1, 1, 81)
    values = 0.49 - side[:, None] ** 2 - side[None, :] ** 2
    assert 4.0 * area(positive(values)) == pytest.approx(np.pi * 0.49, rel=2e-3)
    rim = sum(np.hypot(*(2.0 * (np.array(a) - b))) for a, b in zero(values))
    assert rim == pytest.approx(2.0 * np.pi * 0.7, rel=2e-3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_a_saddle_the_line_is_the_edge_of_the_area(sign: float) -> None:
    values = sign * np.array([[1.0, -1.0], [-1.0, 1.0]])
    (polygon,) = positive(values)
    edges = {frozenset(pair) for pair in zip(polygon, polygon[1:] + polygon[:1], strict=True)}
    pieces = {frozenset(piece) for piece in zero(values)}
    assert len(pieces) == 2
    assert pieces <= edges


def test_runs_of_whole_cells_are_one_polygon() -> None:
    assert len(positive(np.ones((50, 3)))) == 2
    assert positive(-np.ones((4, 4))) == []
