"""What mechanics knows in closed form, asked of each engine with the settings of the lock.

Each function returns ``(found, expected)``. The models are small and made here; what they share
with the lock are step, solver and contacts.
"""

from __future__ import annotations

import contextlib
import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from shearline.evaluator.base import Array
from shearline.sims.bullet_world import BulletSettings, bullet, empty
from shearline.sims.dynamics import GRAVITY
from shearline.sims.scene import Settings

#: A bob on a light rod, let go at this angle [rad].
BOB_KG, ROD_M, LET_GO_RAD = 1.0, 0.5, 1.0

#: A block on a slope that it slides down.
FRICTION, SLOPE, SLIDING_S = 0.25, 0.35, 0.5

#: A block meets one that is at rest and stays with it [kg], [m/s].
MASSES, SPEED = (1.0, 2.0), 0.1


def period() -> float:
    """Return the period of the pendulum [s]: 2 pi sqrt(l / g) / agm(1, cos(a / 2))."""
    a, b = 1.0, math.cos(LET_GO_RAD / 2.0)
    for _ in range(8):
        a, b = (a + b) / 2.0, math.sqrt(a * b)
    return 2.0 * math.pi * math.sqrt(ROD_M / GRAVITY) / a


def pendulum(engine: str) -> tuple[float, float]:
    """Return the period of a large swing [s], over three of them."""
    swing = {"mujoco": _mujoco_pendulum, "pybullet": _bullet_pendulum}[engine]()
    step_s = _step_s(engine)
    # Against the rounding of a crossing to whole steps: a straight line between two of them.
    before = np.flatnonzero((swing[:-1] > 0.0) & (swing[1:] <= 0.0))
    crossings = before + swing[before] / (swing[before] - swing[before + 1])
    return float(np.diff(crossings)[:3].mean() * step_s), period()


def slope(engine: str) -> tuple[float, float]:
    """Return the friction coefficient with which a block slides down a slope."""
    moved = {"mujoco": _mujoco_slide, "pybullet": _bullet_slide}[engine](SLOPE)
    # moved = g (slope - mu) t^2 / 2, on a floor under tilted gravity
    return SLOPE - 2.0 * moved / (GRAVITY * SLIDING_S**2), FRICTION


def holds(engine: str, share: float) -> bool:
    """Tell whether a block holds on a slope of ``share`` times the friction coefficient."""
    slide = {"mujoco": _mujoco_slide, "pybullet": _bullet_slide}[engine]
    return slide(share * FRICTION) < 1e-3


def impact(engine: str) -> tuple[float, float]:
    """Return the speed of the block that was hit [m/s]; restitution is 0."""
    both = {"mujoco": _mujoco_impact, "pybullet": _bullet_impact}[engine]()
    momentum = MASSES[0] * both[0] + MASSES[1] * both[1]
    assert abs(momentum / (MASSES[0] * SPEED) - 1.0) < 1e-6, "momentum is lost"
    return float(both[1]), SPEED * MASSES[0] / sum(MASSES)


def _step_s(engine: str) -> float:
    return Settings().timestep_s if engine == "mujoco" else BulletSettings().timestep_s


# -- MuJoCo ------------------------------------------------------------------------------------


def _mujoco(world: str, gravity: tuple[float, float, float]) -> tuple[Any, Any]:
    s = Settings()
    numbers = " ".join(map(str, gravity))
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="{s.timestep_s}"
 integrator="implicitfast" cone="elliptic" solver="Newton" jacobian="dense" impratio="{s.impratio}"
 gravity="{numbers}"/><default><geom condim="3" friction="{FRICTION} .005 .0001"
 solref="{" ".join(map(str, s.solref))}" solimp="{" ".join(map(str, s.solimp))}"/></default>
<worldbody>{world}</worldbody></mujoco>""")
    return model, mujoco.MjData(model)


def _mujoco_pendulum() -> Array:
    model, data = _mujoco(
        f"""<body><joint type="hinge" axis="0 1 0"/><inertial pos="0 0 {-ROD_M}" mass="{BOB_KG}"
 diaginertia="1e-9 1e-9 1e-9"/></body>""",
        (0.0, 0.0, -GRAVITY),
    )
    data.qpos[0] = LET_GO_RAD
    swing = np.empty(_pendulum_steps("mujoco"))
    for i in range(len(swing)):
        mujoco.mj_step(model, data)
        swing[i] = data.qpos[0]
    return swing


def _mujoco_slide(slope: float) -> float:
    model, data = _mujoco(
        """<geom type="box" pos="0 0 -.05" size="1 1 .05"/><body pos="0 0 .01"><freejoint/>
<geom type="box" size=".02 .02 .01" mass=".1"/></body>""",
        (GRAVITY * slope, 0.0, -GRAVITY),
    )
    mujoco.mj_step(model, data, round(SLIDING_S / model.opt.timestep))
    return float(data.qpos[0])


def _mujoco_impact() -> Array:
    blocks = "".join(
        f"""<body pos="{x} 0 0"><joint type="slide" axis="1 0 0"/><geom type="box"
 size=".02 .02 .02" mass="{mass}"/></body>"""
        for x, mass in zip((-0.03, 0.02), MASSES, strict=True)
    )
    model, data = _mujoco(blocks, (0.0, 0.0, 0.0))
    data.qvel[0] = SPEED
    mujoco.mj_step(model, data, round(0.5 / model.opt.timestep))
    return np.array(data.qvel)


# -- PyBullet ----------------------------------------------------------------------------------


@contextlib.contextmanager
def _bullet(gravity: tuple[float, float, float]) -> Iterator[tuple[Any, int]]:
    b = bullet()
    client = b.connect(b.DIRECT)
    empty(b, client, BulletSettings())
    b.setGravity(*gravity, physicsClientId=client)
    try:
        yield b, client
    finally:
        b.disconnect(client)


def _load(b: Any, client: int, text: str, at: tuple[float, float, float], *, fixed: bool) -> int:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.urdf")
        path.write_text(f'<robot name="model">{text}</robot>')
        flags = b.URDF_USE_INERTIA_FROM_FILE
        body: int = b.loadURDF(
            str(path), at, useFixedBase=fixed, flags=flags, physicsClientId=client
        )
    b.changeDynamics(body, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
    return body


def _block(name: str, mass: float, edges: tuple[float, float, float]) -> str:
    x, y, z = edges
    xx, yy, zz = (mass / 12.0 * (a * a + b * b) for a, b in ((y, z), (x, z), (x, y)))
    return f"""<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="{xx}" iyy="{yy}"
 izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><box size="{x} {y} {z}"/>
</geometry></collision></link>"""


def _soft(b: Any, client: int, body: int, friction: float) -> None:
    s = BulletSettings()
    b.changeDynamics(
        body,
        -1,
        lateralFriction=friction,
        restitution=0.0,
        contactStiffness=s.stiffness,
        contactDamping=s.damping,
        physicsClientId=client,
    )


def _bullet_pendulum() -> Array:
    rod = f"""<link name="ceiling"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="bob"><inertial><origin xyz="0 0 {-ROD_M}"/>
<mass value="{BOB_KG}"/><inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/>
</inertial></link><joint name="hinge" type="continuous"><parent link="ceiling"/><child link="bob"/>
<axis xyz="0 1 0"/></joint>"""
    with _bullet((0.0, 0.0, -GRAVITY)) as (b, client):
        body = _load(b, client, rod, (0.0, 0.0, 0.0), fixed=True)
        b.setJointMotorControl2(body, 0, b.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        b.resetJointState(body, 0, LET_GO_RAD, physicsClientId=client)
        swing = np.empty(_pendulum_steps("pybullet"))
        for i in range(len(swing)):
            b.stepSimulation(physicsClientId=client)
            swing[i] = b.getJointState(body, 0, physicsClientId=client)[0]
    return swing


def _bullet_slide(slope: float) -> float:
    with _bullet((GRAVITY * slope, 0.0, -GRAVITY)) as (b, client):
        floor = _load(b, client, _block("floor", 1.0, (2.0, 2.0, 0.1)), (0, 0, -0.05), fixed=True)
        block = _load(
            b, client, _block("block", 0.1, (0.04, 0.04, 0.02)), (0, 0, 0.01), fixed=False
        )
        _soft(b, client, floor, FRICTION)
        b.changeDynamics(block, -1, lateralFriction=1.0, physicsClientId=client)
        for _ in range(round(SLIDING_S / BulletSettings().timestep_s)):
            b.stepSimulation(physicsClientId=client)
        (x, _, _), _ = b.getBasePositionAndOrientation(block, physicsClientId=client)
    return float(x)


def _bullet_impact() -> Array:
    with _bullet((0.0, 0.0, 0.0)) as (b, client):
        blocks = [
            _load(b, client, _block("block", mass, (0.04,) * 3), (x, 0, 0), fixed=False)
            for x, mass in zip((-0.03, 0.02), MASSES, strict=True)
        ]
        _soft(b, client, blocks[1], FRICTION)
        b.resetBaseVelocity(blocks[0], (SPEED, 0.0, 0.0), physicsClientId=client)
        for _ in range(round(0.5 / BulletSettings().timestep_s)):
            b.stepSimulation(physicsClientId=client)
        return np.array([b.getBaseVelocity(i, physicsClientId=client)[0][0] for i in blocks])


def _pendulum_steps(engine: str) -> int:
    return round(4.5 * period() / _step_s(engine))
