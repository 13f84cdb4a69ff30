"""What a scene looks like, read from its MJCF text: bodies, joints and visible shapes.

The text is the one truth about the scene, whichever engine simulates it, and reading it needs
none. Only what our own scenes use is understood; masses and contacts are passed over.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree as ET

import numpy as np

from shearline.protocol.scene import Body, Joint, SceneData, Shape, ShapeKind

#: Geoms of these groups are there for contacts only.
UNSEEN_GROUPS = frozenset({"4", "5"})
#: Body that takes the pieces in front of what is to be seen, and how little one sees through it.
FRONT = "front"
FRONT_ALPHA = 0.15

_JOINTS = {"hinge": Joint.HINGE, "slide": Joint.SLIDE}
_KINDS = {
    "box": ShapeKind.BOX,
    "sphere": ShapeKind.SPHERE,
    "cylinder": ShapeKind.CYLINDER,
    "capsule": ShapeKind.CAPSULE,
}

_Attributes = Mapping[str, str]


def geometry(
    mjcf: str, columns: Mapping[str, str], *, tip_in: str = "", front: Collection[str] = ()
) -> SceneData:
    """Return what there is to see.

    Args:
        mjcf: Text of the scene.
        columns: Name of a joint to the column of a trace that moves it.
        tip_in: Body in whose frame traces give the tip.
        front: Names of geoms that hide what is to be seen; they become a body of their own, named
            like theirs with ``.front`` behind, that can be left out.
    """
    root = ET.fromstring(mjcf)  # noqa: S314 - our own text, never a stranger's
    reader = _Reader(dict(_defaults(root.find("default"))), columns, frozenset(front))
    world = root.find("worldbody")
    assert world is not None
    reader.read(world, "world", "")
    return SceneData(bodies=reader.bodies, tip_in=tip_in)


@dataclass(slots=True)
class _Reader:
    classes: Mapping[tuple[str, str], _Attributes]
    columns: Mapping[str, str]
    front: frozenset[str]
    bodies: list[Body] = field(default_factory=list)

    def read(self, element: ET.Element, name: str, parent: str) -> None:
        """Add one body, then those that hang on it."""
        geoms = [self._whole(geom) for geom in element.findall("geom")]
        seen = [geom for geom in geoms if _is_seen(geom)]
        self.bodies.append(self._body(element, name, parent, seen))
        if any(geom.get("name") in self.front for geom in seen):
            self.bodies.append(self._front(name, seen))
        for child in element.findall("body"):
            self.read(child, child.attrib["name"], name)

    def _whole(self, element: ET.Element) -> _Attributes:
        """Return an element's attributes with those of its class underneath."""
        own = self.classes.get((element.attrib.get("class", "main"), element.tag), {})
        return {**own, **element.attrib}

    def _body(self, element: ET.Element, name: str, parent: str, seen: list[_Attributes]) -> Body:
        found = element.find("joint")
        joint = {} if found is None else self._whole(found)
        column = self.columns.get(joint.get("name", ""), "")
        return Body(
            name=name,
            parent=parent,
            position=_numbers(element.get("pos", "0 0 0")),
            quaternion=_quaternion(element.get("quat", "1 0 0 0")),
            joint=_JOINTS[joint.get("type", "hinge")] if column else Joint.FIXED,
            axis=_numbers(joint.get("axis", "0 0 1")),
            column=column,
            shapes=[_shape(geom) for geom in seen if geom.get("name") not in self.front],
        )

    def _front(self, name: str, seen: list[_Attributes]) -> Body:
        return Body(
            name=f"{name}.{FRONT}",
            parent=name,
            position=[0.0, 0.0, 0.0],
            quaternion=[0.0, 0.0, 0.0, 1.0],
            joint=Joint.FIXED,
            axis=[0.0, 0.0, 1.0],
            column="",
            shapes=[_shape(geom, FRONT_ALPHA) for geom in seen if geom.get("name") in self.front],
        )


def _defaults(
    element: ET.Element | None, above: Mapping[str, _Attributes] | None = None
) -> Iterator[tuple[tuple[str, str], _Attributes]]:
    """Yield ``((class, tag), attributes)``, those of outer classes underneath."""
    if element is None:
        return
    name = element.attrib.get("class", "main")
    inner = dict(above or {})
    for child in element:
        if child.tag != "default":
            inner[child.tag] = {**inner.get(child.tag, {}), **child.attrib}
    yield from (((name, tag), attributes) for tag, attributes in inner.items())
    for child in element.findall("default"):
        yield from _defaults(child, inner)


def _is_seen(geom: _Attributes) -> bool:
    return geom.get("type") in _KINDS and geom.get("group", "0") not in UNSEEN_GROUPS


def _shape(geom: _Attributes, alpha: float | None = None) -> Shape:
    colour = _numbers(geom.get("rgba", "0.5 0.5 0.5 1"))
    position, quaternion = _numbers(geom.get("pos", "0 0 0")), _quaternion(geom.get("quat", ""))
    size = _numbers(geom["size"])
    if "fromto" in geom:
        position, quaternion, half = _along(_numbers(geom["fromto"]))
        size = [size[0], half]
    return Shape(
        kind=_KINDS[geom["type"]],
        size=size,
        position=position,
        quaternion=quaternion,
        colour=colour if alpha is None else [*colour[:3], alpha],
    )


def _along(ends: list[float]) -> tuple[list[float], list[float], float]:
    """Return centre, turn from z and half length of what lies between two points [m]."""
    start, end = np.array(ends[:3]), np.array(ends[3:])
    length = float(np.linalg.norm(end - start))
    x, y, z = (float(value) for value in (end - start) / length)
    # the shortest turn from z to the direction: its axis is z x d = (-y, x, 0)
    quaternion = np.array([-y, x, 0.0, 1.0 + z]) if z > -1.0 + 1e-9 else np.array([1.0, 0, 0, 0])
    unit = quaternion / np.linalg.norm(quaternion)
    return ((start + end) / 2.0).tolist(), unit.tolist(), length / 2.0


def _quaternion(text: str) -> list[float]:
    """Turn MJCF's w-first text into x, y, z, w."""
    w, x, y, z = _numbers(text) if text else [1.0, 0.0, 0.0, 0.0]
    norm = math.hypot(w, x, y, z)
    return [x / norm, y / norm, z / norm, w / norm]


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]
