"""How the key is held means the same in both engines, and what mechanics says."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.sims import panda
from shearline.sims.bullet_plant import BulletPlant
from shearline.sims.bullet_world import BulletSettings
from shearline.sims.grasp import GRIP_M, Grasp, rubber
from shearline.sims.hold import hold
from shearline.sims.mujoco_plant import MujocoPlant
from shearline.sims.panda import JOINTS, Array
from shearline.sims.plant import Percept, PlantError, Setup, empty_percept
from shearline.sims.scene import Q_START, Pose, Scene, believed_lock_pose, key_in_hand

AnyPlant = MujocoPlant | BulletPlant
Pull = Callable[[AnyPlant, Array], None]

#: Bends the key by .5 mm at the tip [N], and the far end of the skill's pushes [N].
ASIDE_N, PUSH_N = 2.0, 20.0

shifts = st.lists(st.floats(-1e-3, 1e-3), min_size=3, max_size=3)
turns = st.lists(st.floats(-0.05, 0.05), min_size=3, max_size=3)


@pytest.fixture(scope="module", params=[MujocoPlant, BulletPlant])
def giving(request: pytest.FixtureRequest) -> AnyPlant:
    """A plant of either kind with pads that give."""
    plant: AnyPlant = request.param(Scene(grasp=rubber()))
    return plant


@pytest.fixture(scope="module")
def bullet() -> BulletPlant:
    return BulletPlant(Scene(grasp=rubber()))


def _away(pad_scale: float = 1.0) -> Setup:
    """Return a setup in which the lock is out of reach."""
    far = believed_lock_pose().moved(np.array([0.0, 0.0, 0.2]), np.zeros(3))
    return Setup(lock=far, pad_scale=pad_scale)


def _last_link() -> Pose:
    position, rotation = panda.flange_pose(Q_START)
    return Pose(position - rotation @ np.array([0.0, 0.0, panda.FLANGE_M]), rotation)


def _bend(percept: Percept, lock: Pose) -> Array:
    """Return where the true tip is beside the one the arm believes in, in the lock's frame [m]."""
    bend: Array = percept.in_lock - lock.rotation.T @ (percept.tip - lock.position)
    return bend


@given(shift=shifts, turn=turns)
@settings(max_examples=8, deadline=None)
def test_the_verdict_sees_how_the_key_sits_and_the_arm_does_not(
    giving: AnyPlant, shift: list[float], turn: list[float]
) -> None:
    grip, lock = (*shift, *turn), believed_lock_pose()
    plain, felt = empty_percept(), empty_percept()
    for setup, percept in ((Setup(), plain), (Setup(grip=grip), felt)):
        giving.reset(setup)
        giving.sense(percept)
    link = _last_link()
    tip = link.position + link.rotation @ key_in_hand(grip).position
    np.testing.assert_allclose(felt.in_lock, lock.rotation.T @ (tip - lock.position), atol=1e-9)
    for name in ("tip", "rotation", "jacobian"):
        np.testing.assert_array_equal(getattr(felt, name), getattr(plain, name))


@pytest.mark.parametrize("kind", [MujocoPlant, BulletPlant])
def test_a_key_that_is_one_with_the_hand_cannot_sit_off(kind: type[AnyPlant]) -> None:
    with pytest.raises(PlantError, match="expected a scene with a grasp"):
        kind().reset(Setup(grip=(0.0, 1e-4, 0.0, 0.0, 0.0, 0.0)))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("pad_scale", [0.5, 2.0])
def test_a_force_at_the_tip_bends_the_key_by_force_times_arm_over_stiffness(
    axis: int, pad_scale: float
) -> None:
    """And so by the same in both engines."""
    setup = _away(pad_scale=pad_scale)
    along = np.eye(3)[axis]  # a force along x turns the key about y
    expected = ASIDE_N * GRIP_M**2 / (pad_scale * rubber().stiffness[1 - axis])
    scene = Scene(grasp=rubber())
    ours: tuple[AnyPlant, Pull] = (MujocoPlant(scene), _pull_mujoco)
    theirs: tuple[AnyPlant, Pull] = (
        BulletPlant(scene, BulletSettings(substeps=1)),
        _pull_bullet,
    )
    for plant, pull in (ours, theirs):
        percept = _held_still(plant, setup, 300, pull, ASIDE_N * along)
        assert _bend(percept, setup.lock)[axis] == pytest.approx(expected, rel=0.01)


def _held_still(plant: AnyPlant, setup: Setup, ticks: int, pull: Pull, force: Array) -> Percept:
    """Hold the arm on stiff springs while something pulls at the key."""
    percept = empty_percept()
    plant.reset(setup)
    plant.sense(percept)
    for _ in range(ticks):
        pull(plant, force)
        plant.step(percept.bias + 1e4 * (Q_START - percept.q) - 60.0 * percept.dq)
        plant.sense(percept)
    return percept


def _pull_mujoco(plant: AnyPlant, force: Array) -> None:
    """Pull at the tip with a force in the key's frame."""
    assert isinstance(plant, MujocoPlant)
    data, key, tip = plant.data, plant.model.body("key").id, plant.data.site("tip")
    pull = tip.xmat.reshape(3, 3) @ force
    data.xfrc_applied[key] = [*pull, *np.cross(tip.xpos - data.xipos[key], pull)]


def _pull_bullet(plant: AnyPlant, force: Array) -> None:
    assert isinstance(plant, BulletPlant)
    world, b = plant.world, plant.world._bullet
    link = world._links()["blade"]
    pose = b.getLinkState(
        world._arm, link, computeForwardKinematics=1, physicsClientId=world._client
    )
    turn = np.array(b.getMatrixFromQuaternion(pose[5])).reshape(3, 3)
    b.applyExternalForce(
        world._arm,
        link,
        (turn @ force).tolist(),
        pose[4],
        b.WORLD_FRAME,
        physicsClientId=world._client,
    )


def _pressed(plant: AnyPlant, push_n: float, setup: Setup) -> tuple[Percept, Array, Array]:
    """Push the key onto the face of the lock until it rests.

    Returns:
        What is felt, the torques beyond those that carry the arm ``(7,)`` and all tips ``(n, 3)``.
    """
    percept, tips, lock = empty_percept(), [], believed_lock_pose()
    plant.reset(setup)
    plant.sense(percept)
    start = lock.rotation.T @ (percept.tip - lock.position)
    drag = np.array([60.0, 60.0, 200.0, 2.0, 2.0, 2.0])
    pushed = np.zeros(JOINTS)
    for _ in range(900):
        turn = np.kron(np.eye(2), lock.rotation)
        jacobian = turn.T @ percept.jacobian
        off = np.zeros(6)
        off[:3] = start - lock.rotation.T @ (percept.tip - lock.position)
        off[3:] = -_angles(lock.rotation.T @ percept.rotation)
        wrench = np.array([2e3, 2e3, 0.0, 200.0, 200.0, 200.0]) * off
        wrench -= drag * (jacobian @ percept.dq)
        wrench[2] += push_n
        pushed = jacobian.T @ wrench - 2.0 * percept.dq
        plant.step(percept.bias + pushed)
        plant.sense(percept)
        tips.append(percept.in_lock.copy())
    return percept, pushed, np.array(tips)


def _angles(rotation: Array) -> Array:
    """Return a small rotation as a vector."""
    twice: Array = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    return twice / 2.0


def _face() -> Setup:
    """Return a setup in which the face of the lock is 1 mm before the tip, the mouth aside."""
    near = np.array([-5e-3, 0.0, -14e-3])
    return Setup(lock=believed_lock_pose().moved(near, np.zeros(3)))


def test_what_is_felt_at_rest_is_what_holds_against_the_push(giving: AnyPlant) -> None:
    percept, pushed, _ = _pressed(giving, PUSH_N, _face())
    np.testing.assert_allclose(percept.contact, -pushed, atol=0.02)
    force = np.linalg.lstsq(percept.jacobian.T, percept.contact, rcond=None)[0][:3]
    x, y, z = believed_lock_pose().rotation.T @ force
    assert z == pytest.approx(-PUSH_N, rel=0.01)
    assert math.hypot(x, y) < 0.25 * PUSH_N  # what friction can hold


@pytest.mark.parametrize("kind", [MujocoPlant, BulletPlant])
@pytest.mark.parametrize("grasp", [Grasp(), Grasp((1e3, 1e3), (0.5, 0.5))])
def test_a_firm_and_exact_grasp_is_as_good_as_one_piece(kind: type[AnyPlant], grasp: Grasp) -> None:
    """Whether nothing gives, or hardly anything; on ice, as friction keeps what a blow did."""
    setup = replace(_face(), friction=1e-4)
    _, _, tips = _pressed(kind(), PUSH_N, setup)
    _, _, others = _pressed(kind(Scene(grasp=grasp)), PUSH_N, setup)
    assert np.ptp(tips[:, 2]) > 0.9e-3
    np.testing.assert_allclose(others, tips, atol=0.1e-3)
    np.testing.assert_allclose(others[-100:], tips[-100:], atol=10e-6)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("pad_scale", [0.5, 2.0])
def test_a_key_let_go_of_swings_as_the_formula_says(
    bullet: BulletPlant, axis: int, pad_scale: float
) -> None:
    """With the frequency and the decay of a damped swing; the wrist, which gives, adds .1 %."""
    world, b = bullet.world, bullet.world._bullet
    bullet.reset(_away(pad_scale=pad_scale))
    b.resetJointState(world._arm, JOINTS + axis, 0.03, physicsClientId=world._client)
    bullet._read(bullet._states[-1])
    percept, q = empty_percept(), []
    for _ in range(60):
        bullet.sense(percept)
        q.append(bullet._states[-1, 0, JOINTS + axis])
        bullet.step(percept.bias)
    decay, turn = _swing(np.array(q[2:40]))
    grasp, inertia = rubber(), 4e-6 + 0.02 * 6e-3**2
    rate = grasp.damping[axis] / (2.0 * inertia)
    assert decay == pytest.approx(rate, rel=0.005)
    stiffness = pad_scale * grasp.stiffness[axis]
    assert turn == pytest.approx(math.sqrt(stiffness / inertia - rate**2), rel=0.005)
    assert np.abs(q[30:]).max() < np.abs(q[:30]).max()


def _swing(q: Array) -> tuple[float, float]:
    """Return decay [1/s] and circular frequency [rad/s] of samples at 1 ms about some rest."""
    terms = np.stack([q[1:-1], -q[:-2], np.ones(len(q) - 2)], axis=1)
    (both, kept, _), *_ = np.linalg.lstsq(terms, q[2:], rcond=None)
    return -math.log(kept) / 2e-3, math.acos(both / (2.0 * math.sqrt(kept))) / 1e-3


def test_a_free_key_that_swings_is_no_contact(bullet: BulletPlant) -> None:
    percept, world = empty_percept(), bullet.world
    bullet.reset(_away())
    world._bullet.resetJointState(world._arm, JOINTS, 0.03, physicsClientId=world._client)
    bullet._read(bullet._states[-1])
    for _ in range(20):
        bullet.sense(percept)
        bullet.step(percept.bias)
        np.testing.assert_allclose(percept.contact, 0.0, atol=1e-6)


_PROGRAM = """
import hashlib
import numpy as np
from shearline.sims.bullet_plant import BulletPlant
from shearline.sims.grasp import rubber
from shearline.sims.plant import Setup, empty_percept
from shearline.sims.scene import Scene, believed_lock_pose

near = believed_lock_pose().moved(np.array([0.0, 0.0, -14.5e-3]), np.zeros(3))
plant, felt, trace = BulletPlant(Scene(grasp=rubber())), empty_percept(), hashlib.sha256()
plant.reset(Setup(lock=near, grip=(0.0, 3e-4, 1e-4, 0.01, 0.0, 0.0), pad_scale=0.7))
for _ in range(120):
    plant.sense(felt)
    plant.step(felt.bias + felt.jacobian[:3].T @ np.array([0.0, 2.0, -15.0]))
    trace.update(b"".join(part.tobytes() for part in felt))
assert np.abs(felt.contact).max() > 0.1
print(trace.hexdigest())
"""


def test_the_same_setup_gives_the_same_trace_in_another_process(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = [sys.executable, "-c", _PROGRAM]
    there = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    exec(_PROGRAM, {})
    assert capsys.readouterr().out == there != ""


def test_nothing_is_held_where_hand_and_key_are_one_piece() -> None:
    assert hold(Scene(), Setup(), 1e-3) is None
    held = hold(Scene(grasp=Grasp()), Setup(), 1e-3)
    assert held is not None
    assert held.hinges == ()
