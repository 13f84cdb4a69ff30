"""The key-in-lock scene in MuJoCo.

Two ways to drive it share the same compiled primitives: tick by tick from Python
(:meth:`MujocoPlant.sense`, :meth:`MujocoPlant.step`), and from a compiled loop that is given
:class:`Handles` and calls :func:`begin_tick` and :func:`end_tick` itself. MuJoCo's ``mj_step1``
and ``mj_step2`` are called by their C addresses; MjData's arrays are seen as views. Knows no skill.
"""

from __future__ import annotations

import ctypes
import hashlib
import logging
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from shearline.sims.compiled import call_with_two_addresses, compiled
from shearline.sims.lock import PINS
from shearline.sims.panda import JOINTS, Array
from shearline.sims.plant import Percept, PlantError, Setup
from shearline.sims.scene import Scene, quaternion

_log = logging.getLogger(__name__)


class Handles(NamedTuple):
    """Addresses and views through which compiled code drives one simulation.

    Attributes:
        step1: Address of ``mj_step1``.
        step2: Address of ``mj_step2``.
        model: Address of the ``mjModel``.
        data: Address of the ``mjData``.
        substeps: Engine steps in one tick.
        first_pin: Number of the first pin's joint: 7, or 9 where the grasp gives.
        qpos: ``(12,)`` or ``(14,)`` arm first, then grasp, then pins [rad, m].
        qvel: Of as many.
        bias: ``qfrc_bias`` [N m, N].
        constraint: ``qfrc_constraint`` [N m, N].
        applied: ``qfrc_applied``; the motors act here [N m].
        anchor: ``xanchor (joints, 3)`` [m].
        axis: ``xaxis (joints, 3)``.
        tip: ``site_xpos`` of the tip in the nominal grasp ``(3,)`` [m].
        turn: ``site_xmat`` of the same ``(9,)``.
        true_tip: ``site_xpos`` of the tip ``(3,)`` [m].
        lock: ``xpos`` of the lock ``(3,)`` [m].
        lock_turn: ``xmat`` of the lock ``(9,)``.
        contact: Sum of the constraint torques over the substeps of a tick ``(7,)`` [N m].
    """

    step1: int
    step2: int
    model: int
    data: int
    substeps: int
    first_pin: int
    qpos: Array
    qvel: Array
    bias: Array
    constraint: Array
    applied: Array
    anchor: Array
    axis: Array
    tip: Array
    turn: Array
    true_tip: Array
    lock: Array
    lock_turn: Array
    contact: Array


@compiled
def begin_tick(handles: Handles, percept: Percept) -> None:
    """Bring positions and velocities up to date and fill ``percept``."""
    h = handles
    call_with_two_addresses(h.step1, h.model, h.data)
    for j in range(JOINTS):
        percept.q[j] = h.qpos[j]
        percept.dq[j] = h.qvel[j]
        percept.bias[j] = h.bias[j]
        percept.contact[j] = h.contact[j] / h.substeps
        ax, ay, az = h.axis[j, 0], h.axis[j, 1], h.axis[j, 2]
        rx = h.tip[0] - h.anchor[j, 0]
        ry = h.tip[1] - h.anchor[j, 1]
        rz = h.tip[2] - h.anchor[j, 2]
        percept.jacobian[0, j] = ay * rz - az * ry
        percept.jacobian[1, j] = az * rx - ax * rz
        percept.jacobian[2, j] = ax * ry - ay * rx
        percept.jacobian[3, j] = ax
        percept.jacobian[4, j] = ay
        percept.jacobian[5, j] = az
    for i in range(3):
        percept.tip[i] = h.tip[i]
        inside = 0.0
        for k in range(3):
            percept.rotation[i, k] = h.turn[3 * i + k]
            inside += h.lock_turn[3 * k + i] * (h.true_tip[k] - h.lock[k])
        percept.in_lock[i] = inside
    for i in range(PINS):
        percept.pins[i] = h.qpos[h.first_pin + i]


@compiled
def end_tick(handles: Handles, tau: Array) -> None:
    """Apply ``tau (7,)`` [N m] for one tick that :func:`begin_tick` has begun."""
    h = handles
    for j in range(JOINTS):
        h.applied[j] = tau[j]
        h.contact[j] = 0.0
    for step in range(h.substeps):
        if step > 0:
            call_with_two_addresses(h.step1, h.model, h.data)
        call_with_two_addresses(h.step2, h.model, h.data)
        for j in range(JOINTS):
            h.contact[j] += h.constraint[j]


def _quiet() -> None:
    """Keep MuJoCo from writing MUJOCO_LOG.TXT into whatever folder the user stands in.

    What it warns of ends the trial as a :class:`PlantError` all the same. A handler that somebody
    has set already stays.
    """
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(lambda text: _log.debug("mujoco: %s", text))


class MujocoPlant:
    """One simulated arm in front of one lock.

    Args:
        scene: What to simulate.

    Raises:
        PlantError: If this MuJoCo cannot simulate the scene as asked.
    """

    def __init__(self, scene: Scene | None = None) -> None:
        _quiet()
        self.scene = scene or Scene()
        text = self.scene.mjcf()
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        if self.model.opt.jacobian != mujoco.mjtJacobian.mjJAC_DENSE:
            raise PlantError(
                "the model came out with a sparse Jacobian, expected a dense one:"
                " MuJoCo 4.0.0's sparse factorisation is not to be trusted here"
            )
        assert self.model.nv == JOINTS + self.scene.grip_joints + PINS
        self.model_hash = hashlib.sha256(text.encode()).hexdigest()[:12]
        self._stiffness = self.model.jnt_stiffness.copy()
        self._friction = self.model.geom_friction.copy()
        self.handles = _handles(self.model, self.data, self.scene)

    @property
    def engine(self) -> str:
        """Engine, version and the hash of the model."""
        return f"mujoco {mujoco.__version__} model {self.model_hash}"

    def reset(self, setup: Setup) -> None:
        """Go to the start of a trial, at rest.

        Raises:
            PlantError: If the key is to sit off in a scene in which it is one with the hand.
        """
        mujoco.mj_resetData(self.model, self.data)
        self.model.geom_friction[:] = self._friction
        if setup.friction is not None:
            self.model.geom_friction[:, 0] = setup.friction
        first_pin = self.handles.first_pin
        self.model.jnt_stiffness[:] = self._stiffness
        self.model.jnt_stiffness[JOINTS:first_pin] *= setup.pad_scale
        self.model.jnt_stiffness[first_pin:] *= np.array(setup.pin_scale)
        self._hold(setup)
        self.data.qpos[:JOINTS] = setup.q
        self.data.mocap_pos[0] = setup.lock.position
        self.data.mocap_quat[0] = quaternion(setup.lock.rotation)
        self.handles.contact[:] = 0.0

    def _hold(self, setup: Setup) -> None:
        """Put the key between the fingers."""
        pose, key = setup.key_in_hand(self.scene), self.model.body("key")
        if self.scene.grasp is not None:
            key.pos[:] = pose.position
            key.quat[:] = quaternion(pose.rotation)

    def sense(self, percept: Percept) -> None:
        """Fill ``percept`` with the present."""
        begin_tick(self.handles, percept)

    def step(self, tau: Array) -> None:
        """Apply ``tau (7,)`` [N m] for one tick."""
        end_tick(self.handles, tau)
        self.check()

    def check(self) -> None:
        """Raise if the engine has seen a state that is not physical.

        Raises:
            PlantError: With the engine's own name for it.
        """
        for kind in mujoco.mjtWarning.__members__.values():
            if kind != mujoco.mjtWarning.mjNWARNING and self.data.warning[int(kind)].number:
                raise PlantError(
                    f"MuJoCo reported {kind.name} at {self.data.time:.4f} s:"
                    " the simulation is no longer physical, the trial has no verdict"
                )

    def mass_matrix(self) -> Array:
        """Return the arm's joint space inertia ``(7, 7)`` at the present state [kg m^2]."""
        full = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_forward(self.model, self.data)
        mujoco.mj_fullM(self.model, self.data, full)
        return full[:JOINTS, :JOINTS]


def _handles(model: Any, data: Any, scene: Scene) -> Handles:
    true_tip = model.site("tip").id
    tip = true_tip if scene.grasp is None else model.site("held").id
    lock = model.body("lock").id
    return Handles(
        step1=library_address("mj_step1"),
        step2=library_address("mj_step2"),
        model=model._address,  # noqa: SLF001 - MuJoCo's documented way to the C struct
        data=data._address,  # noqa: SLF001
        substeps=scene.settings.substeps,
        first_pin=JOINTS + scene.grip_joints,
        qpos=data.qpos,
        qvel=data.qvel,
        bias=data.qfrc_bias,
        constraint=data.qfrc_constraint,
        applied=data.qfrc_applied,
        anchor=data.xanchor,
        axis=data.xaxis,
        tip=data.site_xpos[tip],
        turn=data.site_xmat[tip],
        true_tip=data.site_xpos[true_tip],
        lock=data.xpos[lock],
        lock_turn=data.xmat[lock],
        contact=np.zeros(JOINTS),
    )


def library_address(function: str) -> int:
    """Return the address of a C function of the MuJoCo that the Python bindings have loaded.

    Raises:
        PlantError: If the installed package is not as expected.
    """
    pointer = getattr(ctypes.CDLL(str(_library())), function)
    return int(ctypes.cast(pointer, ctypes.c_void_p).value or 0)


def _library() -> Path:
    found = sorted(Path(mujoco.__file__).parent.glob("libmujoco.so*"))
    if len(found) != 1:
        raise PlantError(
            f"expected one libmujoco.so beside the mujoco package, found {len(found)}:"
            " reinstall mujoco"
        )
    return found[0]
