"""The key-in-lock scene as URDF: the arm with the key, its motors, the walls of the lock, the pins.

The same numbers as in :mod:`shearline.sims.scene`, for an engine that reads URDF. It is in four
bodies because solving a contact costs with the joints of the bodies that meet in it, whether they
move or not. There is nothing to see in it: pictures are drawn from the scene, whatever simulates
it. What may touch what is decided by link: the blade, which meets the walls, is a part of
the hand, or a link of its own where fingers hold the key, and the bitting, which meets the pins,
one of the key.
"""

from __future__ import annotations

import math

import numpy as np

from shearline.sims import panda
from shearline.sims.grasp import GRIP_M
from shearline.sims.hold import Hold
from shearline.sims.lock import Box, Key, Lock, Pin, Triple, blade, walls
from shearline.sims.panda import Link
from shearline.sims.scene import KEY_INERTIA, KEY_MASS, KEY_TURN, TIP_M, Scene

#: File beside the arm's from which it takes the surface on which the pins ride.
BITTING_MESH = "bitting.obj"

#: How far from pins and bitting a grain of dust is stuck to each of them [m]. Bullet watches for
#: contacts at a distance that grows with how far the smaller of two things extends from its own
#: origin. Pins are small, but at the corners of the bitting they need to be seen earlier than the
#: walls: what is seen too late drops into the key, what is seen too early is held off the walls.
SPECK_M = 0.1

#: How the frame of the bitting's mesh is turned in the key's, about x, then y, then z [rad]: the
#: key's x axis is its diagonal. Bullet looks for contacts only where boxes around the shapes, along
#: the axes of the mesh, overlap. Around a triangle that lies in an axis's plane such a box has no
#: height, and a pin would be let go of as soon as it is a nanometre off.
_ASKEW: Triple = (0.0, math.pi / 4.0, -math.asin(1.0 / math.sqrt(3.0)))

_ZERO: Triple = (0.0, 0.0, 0.0)

#: How the fingers stand on the flange.
_HAND_TURN = -math.pi / 4.0


def arm(scene: Scene, hold: Hold | None = None) -> str:
    """Return the arm with the key in its hand.

    Joints that move come first, in the order of the chain.

    Args:
        scene: With lock and key.
        hold: How the fingers hold the key; ``None``: hand and key are one piece.
    """
    parents = ("base", *(link.name for link in panda.LINKS))
    parts = [_link("base", _anchor())]
    for parent, link in zip(parents, panda.LINKS, strict=False):
        parts += [_arm_joint(parent, link), _arm_link(link)]
    key = scene.lock.key
    parts += _one_piece(key) if hold is None else [*_held(key, hold), _hand_joint(), _hand()]
    return _robot("arm", parts)


def rotors() -> str:
    """Return the rotors of the arm's motors, each a flywheel on an axis of its own.

    Geared one to one to a joint of the arm, a flywheel adds the rotor's inertia to that joint and
    to nothing else: what URDF has no word for.
    """
    parts = [_link("motors", _anchor())]
    for link in panda.LINKS:
        name = f"rotor of {link.name}"
        parts += [
            _joint(name, "continuous", ("motors", name), _ZERO),
            _link(name, _inertial(1.0, _ZERO, (panda.ARMATURE,) * 3)),
        ]
    return _robot("rotors", parts)


def lock_walls(scene: Scene) -> str:
    """Return the lock without its pins; it stands where the lock's frame stands."""
    boxes = (_collision(_box(box), box.centre, _turns(box)) for box in walls(scene.lock))
    return _robot("walls", [_link("walls", _anchor(), *boxes)])


def lock_pins(scene: Scene) -> str:
    """Return the pins of the lock, in the lock's frame."""
    parts = [_link("lock", _anchor())]
    for pin in scene.lock.pins():
        parts += [_pin_joint(pin, scene.lock), _pin_link(pin, scene.lock)]
    return _robot("pins", parts)


def bitting_mesh(key: Key) -> str:
    """Return the surface on which the pins ride, as a Wavefront mesh of triangles.

    Bullet rounds every box by 1 mm where a capsule meets it, and lets nobody change that for a
    link that moves: slabs of 1 mm, as MuJoCo has them, would turn into something else. A surface
    of triangles is not rounded. It is written in a frame of its own (:data:`_ASKEW`).
    """
    half, corners = key.thickness_m / 2.0, key.profile()
    _, pitch, yaw = _ASKEW
    turn = panda.rotation_z(yaw) @ panda.rotation_y(pitch)
    points = [turn.T @ np.array([x, y, -s]) for s, y in corners for x in (half, -half)]
    lines = ["v " + " ".join(repr(float(value)) for value in point) for point in points]
    for i in range(len(corners) - 1):
        a, b, c, d = (2 * i + k for k in (1, 2, 3, 4))
        lines += [f"f {a} {b} {d}", f"f {a} {d} {c}"]
    return "\n".join(lines) + "\n"


def _arm_joint(parent: str, link: Link) -> str:
    low, high = link.range_rad
    limits = (
        f'<limit lower="{low!r}" upper="{high!r}" effort="{link.torque_max!r}"'
        f' velocity="{link.speed_max!r}"/><dynamics damping="{panda.DAMPING!r}" friction="0"/>'
    )
    at = panda.link_offset(link)
    return _joint(link.name, "revolute", (parent, link.name), at, (link.alpha, 0.0, 0.0), limits)


def _arm_link(link: Link) -> str:
    return _link(link.name, _inertial(link.mass, link.centre, link.inertia))


def _one_piece(key: Key) -> list[str]:
    """Return the hand, which has the key's outline, and the key."""
    outline = blade(key)
    centre = (0.0, 0.0, TIP_M + outline.centre[2])
    shape = _collision(_box(outline), centre, (0.0, 0.0, KEY_TURN - _HAND_TURN))
    at, turn = (0.0, 0.0, panda.FLANGE_M + TIP_M), (0.0, 0.0, KEY_TURN)
    place = _joint("key", "fixed", (panda.LINKS[-1].name, "key"), at, turn)
    return [_hand_joint(), _hand(shape), place, _key(key)]


def _held(key: Key, hold: Hold) -> list[str]:
    """Return the key between fingers; its link stands in the middle of the grip."""
    last, (x, y, z) = panda.LINKS[-1].name, hold.middle.position.tolist()
    if not hold.hinges:
        joints, about_y = [_joint("key", "fixed", (last, "key"), (x, y, z), hold.turn)], 0.0
    else:
        about_x, about_y = (hinge.added for hinge in hold.hinges)
        axis = '<axis xyz="1 0 0"/>'
        joints = [
            _joint("grip0", "continuous", (last, "pads"), (x, y, z), hold.turn, axis),
            _link("pads", _inertial(0.0, _ZERO, (about_x,) * 3)),
            _joint("grip1", "continuous", ("pads", "key"), _ZERO, _ZERO, '<axis xyz="0 1 0"/>'),
        ]
    outline = blade(key)
    return [
        *joints,
        _key(key, GRIP_M, about_y),
        _joint("blade", "fixed", ("key", "blade"), (0.0, 0.0, GRIP_M)),
        _link("blade", _inertial(0.0, _ZERO, _ZERO), _collision(_box(outline), outline.centre)),
    ]


def _hand_joint() -> str:
    at, turn = (0.0, 0.0, panda.FLANGE_M), (0.0, 0.0, _HAND_TURN)
    return _joint("hand", "fixed", (panda.LINKS[-1].name, "hand"), at, turn)


def _hand(*shapes: str) -> str:
    inertia = _inertial(panda.HAND_MASS, panda.HAND_CENTRE, panda.HAND_INERTIA)
    return _link("hand", inertia, *shapes)


def _key(key: Key, tip_m: float = 0.0, added: float = 0.0) -> str:
    """Return the key.

    Args:
        key: Its bitting.
        tip_m: Where the tip is along z [m].
        added: Inertia about y [kg m^2]; as that of a rod along x, or Bullet refuses the sum.
    """
    x, y, z = KEY_INERTIA
    return _link(
        "key",
        _inertial(KEY_MASS, (0.0, 0.0, tip_m - key.length_m), (x, y + added, z + added)),
        _collision(f'<mesh filename="{BITTING_MESH}"/>', (0.0, 0.0, tip_m), _ASKEW, concave=True),
        _speck(-SPECK_M, tip_m),
    )


def _pin_joint(pin: Pin, lock: Lock) -> str:
    at = (0.0, pin.rest_y_m + lock.pin_radius_m, pin.z_m)
    more = (
        f'<axis xyz="0 1 0"/><limit lower="0" upper="{lock.pin_travel_m!r}" effort="100"'
        f' velocity="10"/><dynamics damping="{lock.pin_damping!r}" friction="0"/>'
    )
    return _joint(pin.name, "prismatic", ("lock", pin.name), at, _ZERO, more)


def _pin_link(pin: Pin, lock: Lock) -> str:
    inertia = lock.pin_mass * lock.pin_length_m**2 / 12.0
    middle = (0.0, lock.pin_length_m / 2.0, 0.0)
    along_y = (math.pi / 2.0, 0.0, 0.0)
    shape = f'<capsule radius="{lock.pin_radius_m!r}" length="{lock.pin_length_m!r}"/>'
    return _link(
        pin.name,
        _inertial(lock.pin_mass, middle, (inertia,) * 3),
        _collision(shape, middle, along_y),
        _speck(SPECK_M),
    )


def _speck(y: float, z: float = 0.0) -> str:
    """Return a grain of dust that touches nothing; see :data:`SPECK_M`."""
    return _collision('<sphere radius="0.0001"/>', (0.0, y, z))


def _robot(name: str, parts: list[str]) -> str:
    return f'<robot name="{name}">\n{"".join(parts)}</robot>\n'


def _joint(
    name: str,
    kind: str,
    ends: tuple[str, str],
    at: Triple,
    turn: Triple = _ZERO,
    more: str = "",
) -> str:
    parent, child = ends
    axis = "" if "<axis" in more else '<axis xyz="0 0 1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f"{_origin(at, turn)}{axis}{more}</joint>\n"
    )


def _link(name: str, *parts: str) -> str:
    return f'<link name="{name}">{"".join(parts)}</link>\n'


def _anchor() -> str:
    """Return the inertia of what is fixed to the world and never moves."""
    return _inertial(1.0, _ZERO, (1.0, 1.0, 1.0))


def _inertial(mass: float, centre: Triple, inertia: tuple[float, ...]) -> str:
    xx, yy, zz, xy, xz, yz = (*inertia, 0.0, 0.0, 0.0)[:6]
    return (
        f'<inertial>{_origin(centre)}<mass value="{mass!r}"/><inertia ixx="{xx!r}" iyy="{yy!r}"'
        f' izz="{zz!r}" ixy="{xy!r}" ixz="{xz!r}" iyz="{yz!r}"/></inertial>'
    )


def _collision(
    shape: str, at: Triple = _ZERO, turn: Triple = _ZERO, *, concave: bool = False
) -> str:
    kind = ' concave="yes"' if concave else ""
    return f"<collision{kind}>{_origin(at, turn)}<geometry>{shape}</geometry></collision>\n"


def _box(box: Box) -> str:
    x, y, z = (2.0 * half for half in box.half)
    return f'<box size="{x!r} {y!r} {z!r}"/>'


def _turns(box: Box) -> Triple:
    return (box.turn_x, box.turn_y, 0.0)


def _origin(at: Triple, turn: Triple = _ZERO) -> str:
    """Place something: ``turn`` is about x, then y, then z of the frame it is placed in."""
    x, y, z = at
    roll, pitch, yaw = turn
    return f'<origin xyz="{x!r} {y!r} {z!r}" rpy="{roll!r} {pitch!r} {yaw!r}"/>'
