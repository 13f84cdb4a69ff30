"""The scene as ``foxglove.SceneUpdate``: what every tool that knows Foxglove's types can draw.

One entity for each body, in the body's own frame; frames move by ``/tf``. A capsule, which
Foxglove does not have, is a cylinder and two spheres.
"""

from __future__ import annotations

from typing import Any

from shearline.protocol.scene import Body, SceneData, Shape, ShapeKind
from shearline.record.bodies import turned
from shearline.record.foxglove import timestamp
from shearline.record.goal import Goal

#: Of the region of interest: one sees through it.
REGION = [0.34, 0.61, 0.94, 0.2]


def scene_update(scene: SceneData, goal: Goal | None, at_ns: int) -> dict[str, Any]:
    """Return the values of a ``foxglove.SceneUpdate`` that shows all bodies from now on.

    Args:
        scene: What there is.
        goal: Where the tip is to go: its region of interest becomes one more entity.
        at_ns: When [ns since the epoch].
    """
    entities = [_entity(body, at_ns) for body in scene.bodies if body.shapes]
    if goal is not None and scene.tip_in:
        entities.append(_region(goal, scene.tip_in, at_ns))
    return {"entities": entities}


def _region(goal: Goal, frame: str, at_ns: int) -> dict[str, Any]:
    sphere = Shape(
        kind=ShapeKind.SPHERE,
        size=[goal.roi_m],
        position=[0.0, 0.0, goal.depth_m],
        quaternion=[0.0, 0.0, 0.0, 1.0],
        colour=REGION,
    )
    return {
        "timestamp": timestamp(at_ns),
        "frame_id": frame,
        "id": "region_of_interest",
        "frame_locked": True,
        "spheres": [_sphere(sphere, sphere.position)],
    }


def _entity(body: Body, at_ns: int) -> dict[str, Any]:
    cubes, spheres, cylinders = [], [], []
    for shape in body.shapes:
        match shape.kind:
            case ShapeKind.BOX:
                cubes.append(_cube(shape))
            case ShapeKind.SPHERE:
                spheres.append(_sphere(shape, shape.position))
            case ShapeKind.CYLINDER:
                cylinders.append(_cylinder(shape))
            case ShapeKind.CAPSULE:
                cylinders.append(_cylinder(shape))
                spheres += [_sphere(shape, end) for end in _ends(shape)]
    return {
        "timestamp": timestamp(at_ns),
        "frame_id": body.name,
        "id": body.name,
        "frame_locked": True,
        "cubes": cubes,
        "spheres": spheres,
        "cylinders": cylinders,
    }


def _cube(shape: Shape) -> dict[str, Any]:
    edges = [2.0 * half for half in shape.size]
    return {
        "pose": _pose(shape.position, shape.quaternion),
        "size": _vector(edges),
        **_color(shape),
    }


def _sphere(shape: Shape, centre: list[float]) -> dict[str, Any]:
    diameter = 2.0 * shape.size[0]
    pose = _pose(centre, shape.quaternion)
    return {"pose": pose, "size": _vector([diameter] * 3), **_color(shape)}


def _cylinder(shape: Shape) -> dict[str, Any]:
    radius, half = shape.size[:2]
    return {
        "pose": _pose(shape.position, shape.quaternion),
        "size": _vector([2.0 * radius, 2.0 * radius, 2.0 * half]),
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        **_color(shape),
    }


def _ends(shape: Shape) -> list[list[float]]:
    """Return the centres of a capsule's caps."""
    along = turned(shape.quaternion, [0.0, 0.0, shape.size[1]])
    return [
        [p + sign * float(a) for p, a in zip(shape.position, along, strict=True)]
        for sign in (-1.0, 1.0)
    ]


def _pose(position: list[float], quaternion: list[float]) -> dict[str, Any]:
    x, y, z, w = quaternion
    return {"position": _vector(position), "orientation": {"x": x, "y": y, "z": z, "w": w}}


def _vector(values: list[float]) -> dict[str, float]:
    x, y, z = values
    return {"x": x, "y": y, "z": z}


def _color(shape: Shape) -> dict[str, Any]:
    r, g, b, a = shape.colour
    return {"color": {"r": r, "g": g, "b": b, "a": a}}
