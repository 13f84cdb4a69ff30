"""The space: two coordinates of one point, and names that must be right."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.protocol.errors import SpaceError
from shearline.protocol.space import PARAMETERS_MAX, Parameter, Space

SPACE = Space({"push": ("N", 0.0, 20.0), "k_rot": ("N m/rad", 5.0, 200.0)})
finite = st.floats(-1e6, 1e6)


@st.composite
def spaces(draw: st.DrawFn) -> Space:
    bounds = draw(st.lists(st.tuples(finite, st.floats(1e-3, 1e6)), min_size=1, max_size=6))
    return Space({f"p{i}": ("m", low, low + width) for i, (low, width) in enumerate(bounds)})


@given(spaces(), st.data())
def test_normalise_undoes_denormalise_and_the_cube_lands_within_bounds(
    space: Space, data: st.DataObject
) -> None:
    unit = data.draw(st.lists(st.floats(0.0, 1.0), min_size=len(space), max_size=len(space)))
    theta = space.denormalise(unit)
    assert space.contains(theta)
    scale = (np.abs(space.low) + np.abs(space.high)) / (space.high - space.low)
    assert np.all(np.abs(space.normalise(theta) - unit) <= 1e-12 * (1.0 + scale))
    assert np.array_equal(space.to_array(space.to_dict(theta)), theta)


@given(spaces())
def test_corners_are_exact(space: Space) -> None:
    assert np.array_equal(space.denormalise(np.zeros(len(space))), space.low)
    assert np.array_equal(space.denormalise(np.ones(len(space))), space.high)


def test_many_tuples_are_mapped_at_once_and_points_outside_stay_outside() -> None:
    unit = np.array([[[0.5, 0.0]], [[-1.0, 2.0]]])
    theta = SPACE.denormalise(unit)
    assert theta.tolist() == [[[10.0, 5.0]], [[-20.0, 395.0]]]
    assert not SPACE.contains(theta[1, 0])


@pytest.mark.parametrize("theta", [[math.nan, 6.0], [math.inf, 6.0], [-0.1, 6.0], [1.0, 200.1]])
def test_a_tuple_that_is_not_finite_or_out_of_bounds_is_not_contained(theta: list[float]) -> None:
    assert not SPACE.contains(theta)


@given(spaces())
def test_a_space_is_built_again_from_its_spec(space: Space) -> None:
    again = Space(space.spec())
    assert again == space
    assert (hash(again), again.digest()) == (hash(space), space.digest())
    assert (again.names, again.units) == (space.names, ("m",) * len(space))


@pytest.mark.parametrize(
    "other",
    [
        {"push": ("N", 0.0, 20.0)},
        {"k_rot": ("N m/rad", 5.0, 200.0), "push": ("N", 0.0, 20.0)},
        {"push": ("kN", 0.0, 20.0), "k_rot": ("N m/rad", 5.0, 200.0)},
        {"push": ("N", 0.0, math.nextafter(20.0, 21.0)), "k_rot": ("N m/rad", 5.0, 200.0)},
    ],
)
def test_any_difference_changes_the_digest(other: dict[str, tuple[str, float, float]]) -> None:
    assert Space(other).digest() != SPACE.digest()
    assert Space(other) != SPACE


def test_a_parameter_is_found_by_name_or_the_names_are_told() -> None:
    assert SPACE["push"] == Parameter("push", "N", 0.0, 20.0)
    assert [p.name for p in SPACE] == ["push", "k_rot"]
    with pytest.raises(SpaceError, match="expected one of push, k_rot"):
        SPACE["pull"]
    with pytest.raises(SpaceError, match=r"missing \['k_rot'\], unknown \['pull'\]"):
        SPACE.to_array({"push": 1.0, "pull": 2.0})


def test_a_tuple_of_the_wrong_length_is_refused() -> None:
    for wrong in ([1.0], [1.0, 2.0, 3.0], 1.0):
        with pytest.raises(SpaceError, match="expected 2 components"):
            SPACE.normalise(wrong)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ({}, "name them"),
        ({f"x{i}": ("", 0.0, 1.0) for i in range(PARAMETERS_MAX + 1)}, "name them"),
        ({"not a name": ("m", 0.0, 1.0)}, "identifier"),
        ({"x": ("m", 1.0, 0.0)}, "low < high"),
        ({"x": ("m", 0.0, math.nan)}, "finite bounds"),
        ({"x": ("m", 0.0, math.inf)}, "finite bounds"),
        ({"x": ("m", 0.0)}, "needs"),
        ({"x": (1, 0.0, 1.0)}, "needs"),
    ],
)
def test_a_malformed_space_is_refused(
    spec: dict[str, tuple[str, float, float]], message: str
) -> None:
    with pytest.raises(SpaceError, match=message):
        Space(spec)


def test_bounds_cannot_be_changed_behind_the_spaces_back() -> None:
    with pytest.raises(ValueError, match="read-only"):
        SPACE.low[0] = -1.0


def test_the_short_ways_to_a_box_agree() -> None:
    assert Space.unit(3) == Space.box(3, 0.0, 1.0)
    assert repr(Space.unit(1)) == "Space({'x0': ('', 0.0, 1.0)})"
    assert Space.unit(1) != "x0"
