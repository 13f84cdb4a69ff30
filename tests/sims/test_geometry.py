"""What a scene looks like is what it is: bodies move as the kinematics say."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from shearline.protocol.codec import decode, encode
from shearline.protocol.scene import Joint, SceneData, ShapeKind
from shearline.sims.geometry import geometry
from shearline.sims.lock import CUT, PINS, Lock
from shearline.sims.panda import RANGE, Array
from shearline.sims.scene import Scene, believed_lock_pose, tip_pose

COLUMNS = {f"link{j + 1}": f"q.{j + 1}" for j in range(7)} | {"pin0": "pin.1"}
SEEN = geometry(Scene().mjcf(), COLUMNS, tip_in="lock", front=CUT)


def rotation(quaternion: list[float]) -> Array:
    x, y, z, w = quaternion
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Array = np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
    return turn


def world_pose(scene: SceneData, name: str, q: Array) -> tuple[Array, Array]:
    """Walk up from a body; hinges turn about z by their column."""
    bodies = {body.name: body for body in scene.bodies}
    place, turn = np.zeros(3), np.eye(3)
    while name:
        body = bodies[name]
        own = rotation(body.quaternion)
        if body.joint is Joint.HINGE:
            half = q[int(body.column.split(".")[1]) - 1] / 2.0
            own = own @ rotation([0.0, 0.0, float(np.sin(half)), float(np.cos(half))])
        place, turn = np.array(body.position) + own @ place, own @ turn
        name = body.parent
    return place, turn


@given(shares=st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7))
def test_the_key_is_where_the_kinematics_of_the_arm_have_its_tip(shares: list[float]) -> None:
    q = RANGE[:, 0] + np.array(shares) * (RANGE[:, 1] - RANGE[:, 0])
    place, turn = world_pose(SEEN, "key", q)
    expected = tip_pose(q)
    assert np.allclose(place, expected.position, atol=1e-9)
    assert np.allclose(turn, expected.rotation, atol=1e-9)


def test_the_lock_stands_where_the_skill_believes_it() -> None:
    place, turn = world_pose(SEEN, "lock", np.zeros(7))
    assert np.allclose(place, believed_lock_pose().position, atol=1e-9)
    assert np.allclose(turn, believed_lock_pose().rotation, atol=1e-9)


def test_the_lock_can_be_cut_open() -> None:
    bodies = {body.name: body for body in SEEN.bodies}
    assert len(bodies["lock.front"].shapes) == len(CUT)
    assert all(shape.colour[3] < 0.5 for shape in bodies["lock.front"].shapes)
    assert all(shape.colour[3] == 1.0 for shape in bodies["lock"].shapes)


def test_pins_slide_and_are_capsules_of_their_length() -> None:
    pins = [body for body in SEEN.bodies if body.name.startswith("pin")]
    assert len(pins) == PINS
    assert [pin.joint for pin in pins] == [Joint.SLIDE] + [Joint.FIXED] * (PINS - 1)
    (capsule,) = pins[0].shapes
    assert capsule.kind is ShapeKind.CAPSULE
    assert np.allclose(capsule.size, [Lock().pin_radius_m, Lock().pin_length_m / 2.0])
    # lying along y, the axis in which it slides
    assert np.allclose(rotation(capsule.quaternion) @ [0.0, 0.0, 1.0], [0.0, 1.0, 0.0])
    assert pins[0].axis == [0.0, 1.0, 0.0]


def test_what_is_there_for_contacts_only_is_not_seen() -> None:
    key = next(body for body in SEEN.bodies if body.name == "key")
    blade = [2.0 * half for shape in key.shapes for half in shape.size]
    assert Scene().lock.key.length_m not in blade


def test_a_scene_travels() -> None:
    assert decode(encode(SEEN), SceneData) == SEEN
