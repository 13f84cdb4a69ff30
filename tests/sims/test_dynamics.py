"""Our own equations of motion are those of MuJoCo for the same arm."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.sims.dynamics import Body, Chain, chain, forward, inverse, joined
from shearline.sims.grasp import rubber
from shearline.sims.hinge import Hinge
from shearline.sims.hold import hold
from shearline.sims.mujoco_plant import MujocoPlant
from shearline.sims.panda import ARMATURE, JOINTS, RANGE, Array
from shearline.sims.plant import Percept, Setup, empty_percept
from shearline.sims.scene import Scene

_UNIT = st.lists(st.floats(0.0, 1.0), min_size=JOINTS, max_size=JOINTS)


@pytest.fixture(scope="module")
def plant() -> MujocoPlant:
    return MujocoPlant()


@pytest.fixture(scope="module")
def giving() -> MujocoPlant:
    return MujocoPlant(Scene(grasp=rubber()))


def _sensed(plant: MujocoPlant, unit: list[float], dq: Array) -> Percept:
    q = RANGE[:, 0] + np.array(unit) * (RANGE[:, 1] - RANGE[:, 0])
    plant.reset(Setup(q=tuple(q.tolist())))
    plant.data.qvel[:JOINTS] = dq
    percept = empty_percept()
    plant.sense(percept)
    return percept


@given(unit=_UNIT)
@settings(max_examples=20, deadline=None)
def test_the_tip_and_its_jacobian_are_the_engines(plant: MujocoPlant, unit: list[float]) -> None:
    percept = _sensed(plant, unit, np.zeros(JOINTS))
    tip, rotation, jacobian = np.empty(3), np.empty((3, 3)), np.empty((6, JOINTS))
    forward(chain(plant.scene), percept.q, tip, rotation, jacobian)
    np.testing.assert_allclose(tip, percept.tip, atol=1e-12)
    np.testing.assert_allclose(rotation, percept.rotation, atol=1e-12)
    np.testing.assert_allclose(jacobian, percept.jacobian, atol=1e-12)


@given(unit=_UNIT, seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_torques_are_those_that_the_engine_needs(
    plant: MujocoPlant, unit: list[float], seed: int
) -> None:
    dq, ddq = np.random.default_rng(seed).normal(size=(2, JOINTS))
    percept = _sensed(plant, unit, dq)
    tau = np.empty(JOINTS)
    inverse(chain(plant.scene), percept.q, dq, ddq, tau)
    inertia = plant.mass_matrix() - ARMATURE * np.eye(JOINTS)
    np.testing.assert_allclose(tau, percept.bias + inertia @ ddq, atol=1e-9)


def _held(setup: Setup) -> Chain:
    """Return the arm with a key that turns on bare hinges, as MuJoCo has them."""
    held = hold(Scene(grasp=rubber()), setup, 1e-3)
    assert held is not None
    bare = tuple(Hinge(hinge.stiffness, hinge.damping, 0.0) for hinge in held.hinges)
    return chain(Scene(grasp=rubber()), replace(held, hinges=bare))


@given(unit=_UNIT, seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_a_key_that_sits_off_and_turns_in_the_fingers_is_the_engines(
    giving: MujocoPlant, unit: list[float], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    joints = JOINTS + 2
    grip = (rng.normal(size=6) * ([1e-3] * 3 + [0.05] * 3)).tolist()
    setup = Setup(grip=tuple(grip))
    q = np.append(RANGE[:, 0] + np.array(unit) * np.ptp(RANGE, axis=1), 0.1 * rng.normal(size=2))
    dq, ddq = rng.normal(size=(2, joints))
    giving.reset(setup)
    giving.data.qpos[:joints], giving.data.qvel[:joints] = q, dq
    mujoco.mj_forward(giving.model, giving.data)
    full = np.zeros((giving.model.nv, giving.model.nv))
    mujoco.mj_fullM(giving.model, giving.data, full)
    inertia = full[:joints, :joints] - np.diag([ARMATURE] * JOINTS + [0.0] * 2)
    tip, turn, jacobian, tau = (
        np.empty(3),
        np.empty((3, 3)),
        np.empty((6, joints)),
        np.empty(joints),
    )
    forward(_held(setup), q, tip, turn, jacobian)
    inverse(_held(setup), q, dq, ddq, tau)
    np.testing.assert_allclose(tip, giving.data.site("tip").xpos, atol=1e-12)
    np.testing.assert_allclose(turn.ravel(), giving.data.site("tip").xmat, atol=1e-12)
    np.testing.assert_allclose(tau, giving.data.qfrc_bias[:joints] + inertia @ ddq, atol=1e-9)


@given(st.permutations(range(3)))
@settings(max_examples=6, deadline=None)
def test_bodies_are_joined_in_any_order(order: list[int]) -> None:
    rng = np.random.default_rng(0)
    bodies = [Body(mass, rng.normal(size=3), np.diag((1.0, 2.0, 2.5))) for mass in (1.0, 2.0, 0.5)]
    whole, other = joined(bodies), joined(bodies[i] for i in order)
    np.testing.assert_allclose(other.centre, whole.centre)
    np.testing.assert_allclose(other.inertia, whole.inertia)
