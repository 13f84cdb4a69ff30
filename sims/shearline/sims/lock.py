"""Lock and key as data: dimensions, and the boxes and capsules they are made of.

Frames. *Lock*: origin in the centre of the mouth plane, z into the lock, y towards the pins,
x across the blade's thickness. *Key*: origin in the centre of the blade's leading face (the tip),
the same axes; the blade lies at z < 0. Fully inserted, the two frames differ by
``Lock.depth_m`` along z only.

Nothing here knows an engine, a pose in the world or a skill.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

Triple = tuple[float, float, float]

#: Pins of the lock.
PINS = 5

#: Walls that hide key and pins from an eye on the side of positive x: the lock cut open is
#: drawn without them.
CUT = ("wall_xp", "face_xp", "edge_xp")


@dataclass(frozen=True, slots=True)
class Box:
    """A box, turned about one axis of its owner's frame.

    Attributes:
        name: Unique in the scene.
        centre: [m].
        half: Half edge lengths [m].
        turn_x: Rotation about x [rad]; at most one of the turns differs from 0.
        turn_y: Rotation about y [rad].
    """

    name: str
    centre: Triple
    half: Triple
    turn_x: float = 0.0
    turn_y: float = 0.0


@dataclass(frozen=True, slots=True)
class Pin:
    """A spring-loaded pin: a capsule that slides along y.

    Attributes:
        name: Unique in the scene.
        z_m: Where along the keyway it sits [m].
        rest_y_m: Its lowest point when fully sprung out [m].
    """

    name: str
    z_m: float
    rest_y_m: float


@dataclass(frozen=True, slots=True)
class Key:
    """A flat key; cuts are counted from the tip."""

    length_m: float = 26e-3
    height_m: float = 8e-3
    thickness_m: float = 2e-3
    cut_at_m: tuple[float, ...] = (4e-3, 8e-3, 12e-3, 16e-3, 20e-3)
    cut_depth_m: tuple[float, ...] = (0.8e-3, 1.4e-3, 0.6e-3, 1.6e-3, 1.0e-3)
    cut_flat_m: float = 0.8e-3
    slope: float = 1.0  # rise over run of every ramp: 45 degrees; above 47 the pins self-lock
    nose_m: float = 2.8e-3  # length of the ramp at the tip

    def profile(self) -> list[tuple[float, float]]:
        """Return the bitting as ``(distance from the tip, y)`` corners, tip first [m]."""
        top = self.height_m / 2.0
        corners = [(0.0, top - self.nose_m * self.slope), (self.nose_m, top)]
        for at, depth in zip(self.cut_at_m, self.cut_depth_m, strict=True):
            half, run = self.cut_flat_m / 2.0, depth / self.slope
            corners += [
                (at - half - run, top),
                (at - half, top - depth),
                (at + half, top - depth),
                (at + half + run, top),
            ]
        corners.append((self.length_m, top))
        return _distinct(corners)


#: Keys by name. Neighbouring cuts leave room for both their ramps: they add up to no more than
#: their distance less the flats, 3.2 mm; the first is at most .8 mm, behind the ramp at the tip.
KEYS: Mapping[str, Key] = MappingProxyType(
    {
        "a": Key(),
        "b": Key(cut_depth_m=(0.4e-3, 1.6e-3, 0.8e-3, 1.4e-3, 0.6e-3)),
        "c": Key(cut_depth_m=(0.6e-3, 1.0e-3, 1.6e-3, 1.2e-3, 0.8e-3)),
    }
)


@dataclass(frozen=True, slots=True)
class Lock:
    """A pin lock with a rectangular keyway.

    Attributes:
        clearance_y_m: Gap between keyway and blade on each side along y [m].
        clearance_x_m: The same along x [m].
        chamfer_m: Depth and width of the 45 degree chamfer around the mouth [m].
        cavity_m: Where the keyway ends [m].
        depth_m: Depth of the tip at which the key counts as inserted [m].
        wall_m: Thickness of all walls [m].
        friction: Coulomb coefficient of every contact.
        pin_mass: [kg].
        pin_stiffness: [N/m].
        pin_preload_n: Spring force of a fully sprung out pin [N].
        pin_damping: [N s/m].
        pin_radius_m: Radius of the capsule's round end [m].
        pin_length_m: Length of its shaft [m].
        pin_rest_y_m: Lowest point of a fully sprung out pin [m].
        pin_travel_m: How far it can be pushed in [m].
    """

    key: Key = field(default_factory=Key)
    clearance_y_m: float = 0.1e-3
    clearance_x_m: float = 0.075e-3
    chamfer_m: float = 1e-3
    cavity_m: float = 25e-3
    depth_m: float = 24.5e-3
    wall_m: float = 6e-3
    friction: float = 0.25
    pin_mass: float = 1e-3
    pin_stiffness: float = 150.0
    pin_preload_n: float = 0.8
    pin_damping: float = 0.1
    pin_radius_m: float = 0.75e-3
    pin_length_m: float = 5e-3
    pin_rest_y_m: float = 1.6e-3
    pin_travel_m: float = 6e-3

    @property
    def half_x_m(self) -> float:
        """Half width of the keyway [m]."""
        return self.key.thickness_m / 2.0 + self.clearance_x_m

    @property
    def half_y_m(self) -> float:
        """Half height of the keyway [m]."""
        return self.key.height_m / 2.0 + self.clearance_y_m

    def pins(self) -> list[Pin]:
        """Return the pins, in the order of the key's cuts (deepest in the lock first)."""
        return [
            Pin(f"pin{i}", self.depth_m - at, self.pin_rest_y_m)
            for i, at in enumerate(self.key.cut_at_m)
        ]


def blade(key: Key) -> Box:
    """Return the box that touches the walls of the keyway (the key's outline, uncut)."""
    half = (key.thickness_m / 2.0, key.height_m / 2.0, key.length_m / 2.0)
    return Box("blade", (0.0, 0.0, -half[2]), half)


def bitting(key: Key) -> list[Box]:
    """Return the slabs, one for each stretch of the profile, on which the pins ride."""
    corners = key.profile()
    return [
        _slab(f"bitting{i}", start, end, key.thickness_m / 2.0)
        for i, (start, end) in enumerate(itertools.pairwise(corners))
    ]


def body(key: Key) -> list[Box]:
    """Return what lies under the slabs of the bitting; it is drawn but touches nothing."""
    low, half_x = -key.height_m / 2.0, key.thickness_m / 2.0
    corners = [
        corner
        for start, end in itertools.pairwise(key.profile())
        for corner in (start, _between(start, end))
    ] + [key.profile()[-1]]
    boxes = []
    for i, ((s0, y0), (s1, y1)) in enumerate(itertools.pairwise(corners)):
        top = min(y0, y1)
        centre = (0.0, (low + top) / 2.0, -(s0 + s1) / 2.0)
        boxes.append(Box(f"body{i}", centre, (half_x, (top - low) / 2.0, (s1 - s0) / 2.0)))
    return boxes


def walls(lock: Lock) -> list[Box]:
    """Return keyway, chamfers, face and bottom of the lock."""
    hx, hy, c, t = lock.half_x_m, lock.half_y_m, lock.chamfer_m, lock.wall_m
    mid, deep = (lock.cavity_m + c) / 2.0, (lock.cavity_m - c) / 2.0
    wide, slab, diagonal = hx + c + t, 0.5e-3, c / math.sqrt(2.0)
    boxes = [Box("bottom", (0.0, 0.0, lock.cavity_m + t / 2.0), (wide, hy + c + t, t / 2.0))]
    # A chamfer's surface runs from (h + c, z = 0) to (h, z = c); its slab lies behind it.
    behind = slab / math.sqrt(2.0)
    for sign, side in ((1.0, "p"), (-1.0, "n")):
        x, y = sign * (hx + t / 2.0), sign * (hy + t / 2.0)
        fx, fy = sign * (hx + c + t / 2.0), sign * (hy + c + t / 2.0)
        cx, cy = sign * (hx + c / 2.0 + behind), sign * (hy + c / 2.0 + behind)
        cz, quarter = c / 2.0 + behind, sign * math.pi / 4.0
        boxes += [
            Box(f"wall_x{side}", (x, 0.0, mid), (t / 2.0, hy + t, deep)),
            Box(f"wall_y{side}", (0.0, y, mid), (hx, t / 2.0, deep)),
            Box(f"face_x{side}", (fx, 0.0, c / 2.0), (t / 2.0, hy + c + t, c / 2.0)),
            Box(f"face_y{side}", (0.0, fy, c / 2.0), (hx + c, t / 2.0, c / 2.0)),
            Box(f"edge_x{side}", (cx, 0.0, cz), (slab, hy + c, diagonal), turn_y=-quarter),
            Box(f"edge_y{side}", (0.0, cy, cz), (hx + c, slab, diagonal), turn_x=quarter),
        ]
    return boxes


def _slab(name: str, start: tuple[float, float], end: tuple[float, float], half_x: float) -> Box:
    """Lay a slab under the line from ``start`` to ``end``, both ``(distance from tip, y)``."""
    thick = 0.5e-3
    run, rise = end[0] - start[0], end[1] - start[1]
    length = math.hypot(run, rise)
    s, y = (start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0
    # Its outer normal in (distance, y) is (-rise, run) / length; z is minus the distance.
    centre = (0.0, y - thick * run / length, -(s + thick * rise / length))
    return Box(name, centre, (half_x, thick, length / 2.0), turn_x=math.atan2(rise, run))


def _between(start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float]:
    return ((start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0)


def _distinct(corners: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Drop corners that repeat the one before."""
    kept = corners[:1]
    for corner in corners[1:]:
        if math.dist(corner, kept[-1]) > 1e-9:
            kept.append(corner)
    return kept
