"""Path data: whole, within the plane, and upside down as SVG has it."""

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from shearline.record.report import marks

SHARES = st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=1, max_size=20)


def numbers(data: str) -> list[float]:
    return [float(found) for found in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", data)]


@given(SHARES)
def test_a_line_goes_through_all_points_with_y_up(points: list[tuple[float, float]]) -> None:
    x, y = zip(*points, strict=True)
    data = marks.line(x, y)
    found = np.array(numbers(data)).reshape(-1, 2)
    np.testing.assert_allclose(found[:, 0] / marks.SIDE, x, atol=1e-4)
    np.testing.assert_allclose(1.0 - found[:, 1] / marks.SIDE, y, atol=1e-4)
    assert data.count("M") == 1
    assert data.count("L") == len(points) - 1


@given(SHARES)
def test_there_is_one_dot_one_bar_and_one_upright_for_each_point(
    points: list[tuple[float, float]],
) -> None:
    x, y = zip(*points, strict=True)
    assert marks.dots(x, y).count("h0") == len(points)
    assert marks.bars(x, x, 0.0, y).count("Z") == len(points)
    assert marks.uprights(x, 0.0, y).count("V") == len(points)


def test_a_bar_reaches_from_corner_to_corner() -> None:
    assert marks.bars([0.1], [0.2], [0.25], [0.75]) == "M100 250H200V750H100Z"


def test_steps_keep_their_height_until_the_next_point() -> None:
    assert marks.steps([0.0, 0.5, 1.0], [1.0, 0.5, 0.5]) == "M0 0H500V500H1000V500"


def test_a_band_goes_out_on_top_and_comes_back_below() -> None:
    assert marks.band([0.0, 1.0], [0.0, 0.1], [0.9, 1.0]) == "M0 100L1000 0L1000 900L0 1000Z"


def test_nothing_is_drawn_of_nothing() -> None:
    empty: list[float] = []
    drawn = [f(empty, empty) for f in (marks.dots, marks.line, marks.steps)]
    drawn += [marks.band(empty, empty, empty), marks.bars(empty, empty, empty, empty)]
    assert drawn == [""] * 5
