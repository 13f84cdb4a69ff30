"""Our own equations of motion are those of MuJoCo for the same arm."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.sims.dynamics import Body, chain, forward, inverse, joined
from shearline.sims.mujoco_plant import MujocoPlant
from shearline.sims.panda import ARMATURE, JOINTS, RANGE, Array
from shearline.sims.plant import Percept, Setup, empty_percept

_UNIT = st.lists(st.floats(0.0, 1.0), min_size=JOINTS, max_size=JOINTS)


@pytest.fixture(scope="module")
def plant() -> MujocoPlant:
    return MujocoPlant()


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


@given(st.permutations(range(3)))
@settings(max_examples=6, deadline=None)
def test_bodies_are_joined_in_any_order(order: list[int]) -> None:
    rng = np.random.default_rng(0)
    bodies = [Body(mass, rng.normal(size=3), np.diag((1.0, 2.0, 2.5))) for mass in (1.0, 2.0, 0.5)]
    whole, other = joined(bodies), joined(bodies[i] for i in order)
    np.testing.assert_allclose(other.centre, whole.centre)
    np.testing.assert_allclose(other.inertia, whole.inertia)
