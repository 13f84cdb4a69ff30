"""The key-in-lock scene: arm, key in the gripper, lock on a post, as one MJCF text.

The lock is a mocap body: its pose is data, so that a new pose needs no new model. The numbers
come from :mod:`shearline.sims.panda` and :mod:`shearline.sims.lock`; this file adds where
things stand and how the engine is to solve the contacts, and knows no skill.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from shearline.sims import panda
from shearline.sims.grasp import GRIP_M, Grasp
from shearline.sims.lock import Box, Lock, Pin, bitting, blade, body, walls
from shearline.sims.panda import Array, Link

#: Joint angles from which every trial starts: the tool points straight down [rad].
Q_START: Array = np.array([0.0, 0.1, 0.0, -2.2, 0.0, 2.3, math.pi / 4.0])

#: The lock's mouth is believed to be this far in front of the tip at the start [m].
START_GAP_M = 15e-3

#: From the flange to the tip of the key along z; the bow is held between the fingers [m].
TIP_M = panda.HAND_REACH_M + 38e-3

#: The key's x axis (thickness) is the closing direction of the fingers.
KEY_TURN = math.pi / 4.0

#: The key with its bow: mass [kg], inertia about its centre of mass at the bow [kg m^2].
KEY_MASS = 0.02
KEY_INERTIA = (4e-6, 4e-6, 2e-6)

#: One tick of the controller [s].
TICK_S = 1e-3


@dataclass(frozen=True, slots=True)
class Settings:
    """How MuJoCo solves the scene; the defaults are the ones shown to be converged.

    Attributes:
        timestep_s: Must divide :data:`TICK_S`.
        solref: Time constant [s] and damping ratio of contacts.
        solimp: Impedance of contacts.
        impratio: Stiffness of friction over that of the normal force.
    """

    timestep_s: float = 5e-4
    solref: tuple[float, float] = (0.002, 1.0)
    solimp: tuple[float, float, float, float, float] = (0.95, 0.99, 0.0001, 0.5, 2.0)
    impratio: float = 10.0

    @property
    def substeps(self) -> int:
        """Steps of the engine in one tick of the controller."""
        return round(TICK_S / self.timestep_s)


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a frame is: ``position (3,)`` [m] and ``rotation (3, 3)`` in the base frame."""

    position: Array
    rotation: Array

    def moved(self, shift: Array, turn: Array) -> Pose:
        """Return the pose shifted and then turned (x, then y, then z), both in its own frame.

        Args:
            shift: ``(3,)`` [m].
            turn: ``(3,)`` [rad].
        """
        x, y, z = (float(angle) for angle in turn)
        rotation = panda.rotation_z(z) @ panda.rotation_y(y) @ panda.rotation_x(x)
        return Pose(self.position + self.rotation @ shift, self.rotation @ rotation)


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything that decides the model: a change of any field changes the model's hash.

    Attributes:
        lock: With its key.
        settings: How MuJoCo solves it.
        grasp: What is between hand and key; ``None``: they are one piece.
    """

    lock: Lock = field(default_factory=Lock)
    settings: Settings = field(default_factory=Settings)
    grasp: Grasp | None = None

    @property
    def grip_joints(self) -> int:
        """Joints between hand and key, about x and y of the key."""
        return 0 if self.grasp is None else len(self.grasp.stiffness)

    def mjcf(self) -> str:
        """Return the model as MJCF text."""
        return _mjcf(self)


def tip_pose(q: Array) -> Pose:
    """Return the pose of the key's tip at joint angles ``q (7,)`` [rad]."""
    position, rotation = panda.flange_pose(q)
    tip = position + rotation @ np.array([0.0, 0.0, TIP_M])
    return Pose(tip, rotation @ panda.rotation_z(KEY_TURN))


def key_in_hand(grip: tuple[float, ...] = (0.0,) * 6) -> Pose:
    """Return the frame of the key in that of the last link, for a key that sits off by ``grip``.

    Args:
        grip: As in :class:`~shearline.sims.plant.Setup` ``(6,)`` [m, rad].
    """
    nominal = Pose(np.array([0.0, 0.0, panda.FLANGE_M + TIP_M]), panda.rotation_z(KEY_TURN))
    middle = np.array([0.0, 0.0, -GRIP_M])
    return nominal.moved(middle + grip[:3], np.array(grip[3:])).moved(-middle, np.zeros(3))


def believed_lock_pose() -> Pose:
    """Return where the skill believes the lock to be: straight in front of the start pose."""
    return tip_pose(Q_START).moved(np.array([0.0, 0.0, START_GAP_M]), np.zeros(3))


def quaternion(rotation: Array) -> Array:
    """Return the unit quaternion ``(4,)``, w first, of a rotation ``(3, 3)``."""
    r = rotation
    candidates = 0.25 * np.array(
        [
            1.0 + r[0, 0] + r[1, 1] + r[2, 2],
            1.0 + r[0, 0] - r[1, 1] - r[2, 2],
            1.0 - r[0, 0] + r[1, 1] - r[2, 2],
            1.0 - r[0, 0] - r[1, 1] + r[2, 2],
        ]
    )
    products = np.array(
        [
            [candidates[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], candidates[1], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], candidates[2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], candidates[3]],
        ]
    )
    largest = int(np.argmax(candidates))
    w = math.sqrt(float(candidates[largest]))
    row = products[largest] / (4.0 * w)
    row[largest] = w
    unit: Array = row / np.linalg.norm(row)
    return unit


def _mjcf(scene: Scene) -> str:
    s, lock = scene.settings, scene.lock
    believed = believed_lock_pose()
    return f"""<mujoco model="keylock">
<compiler angle="radian" autolimits="true"/>
<option timestep="{s.timestep_s!r}" integrator="implicitfast" cone="elliptic" solver="Newton"
 jacobian="dense" impratio="{s.impratio!r}"/>
<size memory="8M"/>
<visual><global offwidth="1280" offheight="960" fovy="35"/><map znear="0.002"/>
<quality shadowsize="4096"/><headlight ambient=".35 .35 .35" diffuse=".30 .30 .30"/></visual>
<asset><texture type="skybox" builtin="gradient" rgb1="1 1 1" rgb2=".86 .89 .93" width="64"
 height="384"/></asset>
<default>
<geom condim="3" friction="{lock.friction!r} 0.005 0.0001" solref="{_text(s.solref)}"
 solimp="{_text(s.solimp)}" mass="0"/>
<default class="drawn"><geom contype="0" conaffinity="0" group="1"/></default>
<default class="wall"><geom type="box" contype="1" conaffinity="0" rgba=".70 .55 .26 1" group="2"/>
</default>
<default class="blade"><geom type="box" contype="0" conaffinity="1" group="4"/></default>
<default class="bitting"><geom type="box" contype="0" conaffinity="2" rgba=".58 .61 .66 1"
 group="1"/></default>
<default class="pin"><geom type="capsule" contype="2" conaffinity="0" rgba=".85 .35 .22 1"
 group="3"/><joint type="slide" axis="0 1 0" range="0 {lock.pin_travel_m!r}"
 stiffness="{lock.pin_stiffness!r}" springref="{-lock.pin_preload_n / lock.pin_stiffness!r}"
 damping="{lock.pin_damping!r}" solreflimit="{_text(s.solref)}" solimplimit="{_text(s.solimp)}"/>
</default>
<default class="arm"><joint type="hinge" axis="0 0 1" armature="{panda.ARMATURE!r}"
 damping="{panda.DAMPING!r}"/></default>
</default>
<worldbody>
<light pos="0.6 -1.2 1.6" dir="-0.05 0.7 -0.8" diffuse=".40 .40 .40"/>
<geom name="floor" class="drawn" type="plane" size="1.5 1.5 0.05" rgba=".90 .91 .92 1"/>
{_post(believed)}
<geom class="drawn" type="capsule" fromto="0 0 0 0 0 0.25" size="0.07" rgba=".93 .94 .95 1"/>
{_arm(panda.LINKS, scene)}
<body name="lock" mocap="true" pos="{_text(believed.position)}"
 quat="{_text(quaternion(believed.rotation))}">
{"".join(_geom(box, "wall") for box in walls(lock))}
{"".join(_pin(pin, lock) for pin in lock.pins())}
</body>
</worldbody>
</mujoco>
"""


def _arm(links: tuple[Link, ...], scene: Scene) -> str:
    """Nest the links from ``links[0]`` on, with the tool on the last one."""
    if not links:
        return _tool(scene)
    link, rest = links[0], links[1:]
    x, y, z = panda.link_offset(link)
    low, high = link.range_rad
    return f"""<body name="{link.name}" pos="{_text((x, y, z))}"
 quat="{_text((math.cos(link.alpha / 2.0), math.sin(link.alpha / 2.0), 0.0, 0.0))}">
<joint class="arm" name="{link.name}" range="{low!r} {high!r}"/>
<inertial pos="{_text(link.centre)}" mass="{link.mass!r}" fullinertia="{_text(link.inertia)}"/>
{_sleeves(link, rest)}
{_arm(rest, scene)}
</body>"""


def _sleeves(link: Link, rest: tuple[Link, ...]) -> str:
    """Draw a link: a drum about its axis and a tube to the next joint."""
    radius = 0.058 if link.torque_max > 50.0 else 0.048
    drum = (
        f'<geom class="drawn" type="cylinder" fromto="0 0 -0.06 0 0 0.06" size="{radius}"'
        ' rgba=".30 .33 .38 1"/>'
    )
    end = panda.link_offset(rest[0]) if rest else (0.0, 0.0, panda.FLANGE_M)
    if math.hypot(*end) < 0.05:
        return drum
    return drum + (
        f'<geom class="drawn" type="capsule" fromto="0 0 0 {_text(end)}" size="{radius * 0.85}"'
        ' rgba=".93 .94 .95 1"/>'
    )


def _tool(scene: Scene) -> str:
    key = scene.lock.key
    turn = KEY_TURN / 2.0
    bow = TIP_M - panda.HAND_REACH_M - key.length_m
    boxes = _geom(blade(key), "blade")
    boxes += "".join(_geom(box, "drawn", ".58 .61 .66 1") for box in body(key))
    boxes += "".join(_geom(box, "bitting") for box in bitting(key))
    half = math.pi / 8.0
    quat = _text((math.cos(turn), 0.0, 0.0, math.sin(turn)))
    place = f'pos="0 0 {panda.FLANGE_M + TIP_M!r}"\n quat="{quat}"'
    return f"""<body name="hand" pos="0 0 {panda.FLANGE_M!r}"
 quat="{_text((math.cos(half), 0.0, 0.0, -math.sin(half)))}">
<inertial pos="{_text(panda.HAND_CENTRE)}" mass="{panda.HAND_MASS!r}"
 diaginertia="{_text(panda.HAND_INERTIA)}"/>
<geom class="drawn" type="box" pos="0 0 .03" size=".02 .09 .03" rgba=".93 .94 .95 1"/>
<geom class="drawn" type="box" pos="0 .012 .082" size=".009 .011 .028" rgba=".30 .33 .38 1"/>
<geom class="drawn" type="box" pos="0 -.012 .082" size=".009 .011 .028" rgba=".30 .33 .38 1"/>
</body>
{_held(scene.grasp, place)}<body name="key" {place}>
<inertial pos="0 0 {-key.length_m!r}" mass="{KEY_MASS!r}" diaginertia="{_micro(KEY_INERTIA)}"/>
{_grip(scene.grasp)}<site name="tip" size="0.0003" group="5"/>
<geom class="drawn" type="box" pos="0 0 {-key.length_m - bow / 2.0!r}"
 size="{key.thickness_m / 2.0!r} .0095 {bow / 2.0!r}" rgba=".58 .61 .66 1"/>
{boxes}
</body>"""


def _held(grasp: Grasp | None, place: str) -> str:
    """Mark where the tip would be in the nominal grasp, where that may be elsewhere."""
    return "" if grasp is None else f'<site name="held" size="0.0003" group="5" {place}/>\n'


def _grip(grasp: Grasp | None) -> str:
    """Return the joints about which the key turns between the fingers."""
    if grasp is None:
        return ""
    about = zip(("1 0 0", "0 1 0"), grasp.stiffness, grasp.damping, strict=False)
    return "".join(
        f'<joint name="grip{i}" type="hinge" axis="{axis}" pos="0 0 {-GRIP_M!r}"'
        f' stiffness="{stiffness!r}" damping="{damping!r}"/>\n'
        for i, (axis, stiffness, damping) in enumerate(about)
    )


def _pin(pin: Pin, lock: Lock) -> str:
    low = pin.rest_y_m + lock.pin_radius_m
    inertia = lock.pin_mass * lock.pin_length_m**2 / 12.0
    return f"""<body name="{pin.name}" pos="0 {low!r} {pin.z_m!r}">
<inertial pos="0 {lock.pin_length_m / 2.0!r} 0" mass="{lock.pin_mass!r}"
 diaginertia="{_text((inertia,) * 3)}"/>
<joint class="pin" name="{pin.name}"/>
<geom class="pin" name="{pin.name}" fromto="0 0 0 0 {lock.pin_length_m!r} 0"
 size="{lock.pin_radius_m!r}"/></body>"""


def _post(believed: Pose) -> str:
    """Draw what the lock stands on."""
    x, y, z = (float(value) for value in believed.position)
    return (
        f'<geom name="post" class="drawn" type="box" pos="{_text((x, y, (z - 0.036) / 2.0))}"'
        f' size=".02 .02 {(z - 0.036) / 2.0!r}" rgba=".45 .48 .52 1"/>'
    )


def _geom(box: Box, kind: str, rgba: str = "") -> str:
    quat = (
        math.cos((box.turn_x + box.turn_y) / 2.0),
        math.sin(box.turn_x / 2.0),
        math.sin(box.turn_y / 2.0),
        0.0,
    )
    colour = f' rgba="{rgba}"' if rgba else ""
    return (
        f'<geom name="{box.name}" class="{kind}" type="box" pos="{_text(box.centre)}"'
        f' size="{_text(box.half)}" quat="{_text(quat)}"{colour}/>\n'
    )


def _micro(values: tuple[float, ...]) -> str:
    return " ".join(f"{1e6 * value:g}e-6" for value in values)


def _text(values: tuple[float, ...] | Array) -> str:
    """Write numbers so that they read back to the last bit."""
    return " ".join(repr(float(value)) for value in values)
