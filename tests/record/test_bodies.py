"""Bodies stand and move as the scene and the columns say."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.protocol.pose import Placed
from shearline.protocol.scene import Body, Joint, SceneData
from shearline.record import bodies

ANGLES = st.floats(-3.0, 3.0)


def a_body(name: str, parent: str = "", joint: Joint = Joint.FIXED, column: str = "") -> Body:
    return Body(
        name=name,
        parent=parent,
        position=[1.0, 2.0, 3.0],
        quaternion=[np.sin(0.4), 0.0, 0.0, np.cos(0.4)],
        joint=joint,
        axis=[0.0, 0.0, 2.0],
        column=column,
        shapes=[],
    )


ARM = SceneData(
    bodies=[
        a_body("base"),
        a_body("elbow", "base", Joint.HINGE, "q.1"),
        a_body("pin", "elbow", Joint.SLIDE, "pin.1"),
        a_body("stray", "nowhere"),
    ],
    tip_in="pin",
)


def test_a_body_hangs_where_its_ancestors_do_and_a_stray_one_on_the_world() -> None:
    assert bodies.paths(ARM) == {
        "": "",
        "base": "base",
        "elbow": "base/elbow",
        "pin": "base/elbow/pin",
        "stray": "stray",
    }


@given(st.lists(ANGLES, min_size=1, max_size=5))
def test_a_hinge_turns_in_place_and_a_slide_shifts_along_its_turned_axis(
    values: list[float],
) -> None:
    column = np.array(values, dtype=np.float32)
    found = {m.body.name: m for m in bodies.moving(ARM, {"q.1": column, "pin.1": column})}
    assert set(found) == {"elbow", "pin"}
    elbow, pin = found["elbow"], found["pin"]
    assert np.allclose(elbow.position, [1.0, 2.0, 3.0])
    assert np.allclose(np.linalg.norm(elbow.quaternion, axis=1), 1.0, atol=1e-6)
    # about its own z after a turn of .8 about x: the axis itself stays where the scene has it
    axis = bodies.turned(ARM.bodies[1].quaternion, [0.0, 0.0, 1.0])
    for quaternion in elbow.quaternion:
        assert np.allclose(bodies.turned(quaternion, [0.0, 0.0, 1.0]), axis, atol=1e-5)
    shift = bodies.turned(ARM.bodies[2].quaternion, [0.0, 0.0, 2.0])
    assert np.allclose(pin.position, np.array([1.0, 2.0, 3.0]) + np.outer(column, shift), atol=1e-5)


def test_what_has_no_column_does_not_move() -> None:
    assert list(bodies.moving(ARM, {"other": np.zeros(3, np.float32)})) == []


def test_a_body_stands_where_its_trial_placed_it() -> None:
    own = Placed(body="base", position=[9.0, 0.0, 0.0], quaternion=[0.0, 0.0, 0.0, 1.0])
    stands = {place.body: place for place in bodies.standing(ARM, [own])}
    assert stands["base"] == own
    assert stands["stray"].position == [1.0, 2.0, 3.0]


@given(a=ANGLES, b=ANGLES)
def test_turns_about_one_axis_add_up(a: float, b: float) -> None:
    axis = np.array([[1.0, 2.0, -1.0]])
    both = bodies.product(bodies.about(axis, [a]), bodies.about(axis, [b]))
    assert both == pytest.approx(bodies.about(axis, [a + b]), abs=1e-9)
