"""A trial in space: the scene's bodies, the path of the tip, the force along it, where it is to go.

Entities hang below one root as the bodies hang on each other, so that a view may look from the
world or from inside the lock. What a record does not say is not drawn; where it knows no scene,
the lock is a plain block.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import rerun as rr

from shearline.protocol.pose import Placed
from shearline.protocol.scene import Body, SceneData, Shape, ShapeKind
from shearline.record.bodies import Motion, moving, paths, standing, turned
from shearline.record.goal import Goal
from shearline.record.palette import BLUE, ORANGE, packed
from shearline.record.sheet import Sheet, Times

Array = npt.NDArray[np.float32]

#: Arrows of force drawn along one path, and their scale [m/N].
ARROWS = 24
METRES_PER_NEWTON = 0.0005
#: Without a scene the lock is a block around its keyway, half as wide and high as this [m].
LOCK_HALF_M = (0.006, 0.010)
#: Of the tip while it moves.
BRIGHT = (255, 230, 120)


class Space:
    """The entities below one root.

    Args:
        sheet: Where rows go.
        root: Entity below which everything stands.
        scene: What there is to see, if the record knows.
        goal: Where the tip is to go, if the run says.
    """

    def __init__(self, sheet: Sheet, root: str, scene: SceneData | None, goal: Goal | None) -> None:
        self.root = root
        self._sheet = sheet
        self._scene = scene
        self._goal = goal
        self._free: set[str] | None = None
        self._moved: set[str] = set()
        self._has_goal = False
        below = paths(scene) if scene else {}
        self._paths = {name: f"{root}/{path}" if path else root for name, path in below.items()}
        #: Entity in whose frame the tip is.
        self.tip_frame = self._paths.get(scene.tip_in, root) if scene else root

    def stand(self, placed: Sequence[Placed], columns: Mapping[str, Array], times: Times) -> None:
        """Say where bodies stand in one trial, and once what they look like.

        Args:
            placed: Those whose place is this trial's own.
            columns: Names say which bodies move.
            times: One row's.
        """
        if self._scene is None:
            return
        if self._free is None:
            own = {place.body for place in placed}
            moved = {body.name for body in self._scene.bodies if body.column in columns}
            self._free = own | moved
            self._moved = moved
            self._draw_bodies()
        for place in standing(self._scene, placed):
            if place.body in self._free - self._moved:
                self._sheet.rows(
                    self._paths[place.body],
                    times,
                    rr.Transform3D,
                    translation=np.array([place.position], dtype=np.float32),
                    quaternion=np.array([place.quaternion], dtype=np.float32),
                )

    def move(self, columns: Mapping[str, Array], times: Times) -> None:
        """Move the bodies whose columns are given, one row for each sample."""
        for motion in moving(self._scene, columns) if self._scene else ():
            self._move(motion, times)

    def columns(self) -> list[str]:
        """Return the columns of a trace that move something."""
        bodies = self._scene.bodies if self._scene else []
        return [body.column for body in bodies if body.column]

    def path(self, tip: Array, colour: tuple[int, int, int], times: Times) -> None:
        """Draw the whole path of the tip ``(samples, 3)`` [m] and where it ended."""
        at = self.tip_frame
        colours = np.array([packed(colour)], dtype=np.uint32)
        self._sheet.rows(
            f"{at}/path",
            times,
            rr.LineStrips3D,
            strips=tip[None].astype(np.float32),
            colors=colours,
        )
        self._sheet.rows(f"{at}/end", times, rr.Points3D, positions=tip[-1:], colors=colours)

    def forces(self, tip: Array, force: Array, times: Times) -> None:
        """Draw the force ``(samples, 3)`` [N] along the path, sparsely."""
        at = np.linspace(0, len(tip) - 1, ARROWS).astype(int)
        self._sheet.rows(
            f"{self.tip_frame}/forces",
            times,
            rr.Arrows3D,
            each=ARROWS,
            origins=tip[at],
            vectors=force[at] * np.float32(METRES_PER_NEWTON),
        )

    def tip(self, tip: Array, times: Times) -> None:
        """Move the tip ``(samples, 3)`` [m], one row for each sample."""
        self._sheet.rows(f"{self.tip_frame}/tip", times, rr.Points3D, positions=tip)

    def force(self, tip: Array, force: Array, times: Times) -> None:
        """Move one arrow of force with the tip, one row for each sample."""
        self._sheet.rows(
            f"{self.tip_frame}/force",
            times,
            rr.Arrows3D,
            origins=tip,
            vectors=force * np.float32(METRES_PER_NEWTON),
        )

    def style(self) -> None:
        """Say once how thick things are."""
        at, sheet = self.tip_frame, self._sheet
        sheet.static(f"{at}/path", rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(1.6)))
        sheet.static(f"{at}/end", rr.Points3D.from_fields(radii=[0.0006]))
        sheet.static(f"{at}/tip", rr.Points3D.from_fields(colors=[BRIGHT], radii=[0.0008]))
        arrows = rr.Arrows3D.from_fields(colors=[ORANGE], radii=[0.00012])
        sheet.static(f"{at}/forces", arrows)
        sheet.static(f"{at}/force", rr.Arrows3D.from_fields(colors=[ORANGE], radii=[0.0003]))

    def goal(self) -> None:
        """Draw once where the tip is to go: the region of interest, and a lock if none is known."""
        if self._goal is None or self._has_goal:
            return
        self._has_goal = True
        depth_m, roi_m = self._goal.depth_m, self._goal.roi_m
        if self._scene is None:
            block = rr.Boxes3D(
                centers=[(0.0, 0.0, depth_m / 2.0)],
                half_sizes=[(*LOCK_HALF_M, depth_m / 2.0)],
                colors=[(150, 150, 165)],
                radii=0.0001,
            )
            self._sheet.static(f"{self.tip_frame}/lock", block)
        region = rr.Ellipsoids3D(
            centers=[(0.0, 0.0, depth_m)],
            half_sizes=[(roi_m,) * 3],
            colors=[BLUE],
            line_radii=0.00003,
        )
        self._sheet.static(f"{self.tip_frame}/region_of_interest", region)

    def _move(self, motion: Motion, times: Times) -> None:
        self._sheet.rows(
            self._paths[motion.body.name],
            times,
            rr.Transform3D,
            translation=motion.position,
            quaternion=motion.quaternion,
        )

    def _draw_bodies(self) -> None:
        assert self._scene is not None
        assert self._free is not None
        for body in self._scene.bodies:
            path = self._paths[body.name]
            if body.name not in self._free:
                # what is said for all times cannot be changed later: only of what stays put
                place = rr.Transform3D(
                    translation=body.position, quaternion=rr.Quaternion(xyzw=body.quaternion)
                )
                self._sheet.static(path, place)
            self._draw_shapes(path, body)

    def _draw_shapes(self, path: str, body: Body) -> None:
        for kind in ShapeKind:
            shapes = [shape for shape in body.shapes if shape.kind is kind]
            if shapes:
                self._sheet.static(f"{path}/{kind.value}", _solid(kind, shapes))


def _solid(kind: ShapeKind, shapes: list[Shape]) -> rr.AsComponents:
    centres = [shape.position for shape in shapes]
    turns = [rr.Quaternion(xyzw=shape.quaternion) for shape in shapes]
    colours = [[round(255 * share) for share in shape.colour] for shape in shapes]
    sizes = np.array([[*shape.size, 0.0, 0.0][:3] for shape in shapes])
    solid = rr.components.FillMode.Solid
    match kind:
        case ShapeKind.BOX:
            return rr.Boxes3D(
                centers=centres,
                half_sizes=sizes,
                quaternions=turns,
                colors=colours,
                fill_mode=solid,
            )
        case ShapeKind.SPHERE:
            radii = np.repeat(sizes[:, :1], 3, axis=1)
            return rr.Ellipsoids3D(
                centers=centres, half_sizes=radii, colors=colours, fill_mode=solid
            )
        case ShapeKind.CYLINDER:
            return rr.Cylinders3D(
                centers=centres,
                radii=sizes[:, 0],
                lengths=2.0 * sizes[:, 1],
                quaternions=turns,
                colors=colours,
                fill_mode=solid,
            )
        case ShapeKind.CAPSULE:
            return _capsules(shapes, sizes, colours)


def _capsules(
    shapes: list[Shape], sizes: npt.NDArray[np.float64], colours: list[list[int]]
) -> rr.AsComponents:
    """Draw capsules, which begin at the centre of one cap and not in their middle."""
    turns = [shape.quaternion for shape in shapes]
    starts = [_start(shape, float(half)) for shape, half in zip(shapes, sizes[:, 1], strict=True)]
    return rr.Capsules3D(
        translations=starts,
        radii=sizes[:, 0],
        lengths=2.0 * sizes[:, 1],
        quaternions=[rr.Quaternion(xyzw=turn) for turn in turns],
        colors=colours,
        fill_mode=rr.components.FillMode.Solid,
    )


def _start(shape: Shape, half_m: float) -> list[float]:
    down: list[float] = turned(shape.quaternion, [0.0, 0.0, -half_m]).tolist()
    return [p + d for p, d in zip(shape.position, down, strict=True)]
