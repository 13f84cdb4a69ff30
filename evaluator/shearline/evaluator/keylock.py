"""The key-in-lock task: noise by seed, one trial on the plant, cost and verdict.

Constructing it costs nothing; engine and compiler are loaded by :meth:`KeylockTask.warm`, or by
whatever needs them first. Knows no learner and no wire.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from shearline.evaluator.base import Array, Outcome, TrialAborted
from shearline.evaluator.keylock_draw import draw_setup, scene_of
from shearline.evaluator.keylock_spec import COST_PER_M, ROI_M, SKILL_VERSION, keylock_spec
from shearline.evaluator.keylock_variation import level
from shearline.evaluator.skill.parameters import parameters
from shearline.protocol.pose import Placed
from shearline.protocol.scene import SceneData
from shearline.protocol.task import TaskSpec

if TYPE_CHECKING:
    from shearline.evaluator.skill.execute import Job
    from shearline.evaluator.skill.semantic import Decision, Limits
    from shearline.sims.bullet_plant import BulletPlant
    from shearline.sims.mujoco_plant import MujocoPlant
    from shearline.sims.plant import Setup
    from shearline.sims.scene import Scene

#: A tuple that runs through every phase; the first trial of a process warms caches with it.
_WARM_SEED = 0


#: What can act on the lock.
P = TypeVar("P", "MujocoPlant", "BulletPlant")


class LockTask(ABC, Generic[P]):
    """Insert a key into a lock that is not quite where it is believed to be, on some plant.

    Args:
        name: Level: ``"keylock"``, ``"keylock-limit"`` or ``"keylock-jam"``, with or without
            switches behind it (:mod:`shearline.evaluator.keylock_variation`).
        scene: Scene to simulate; the default is the level's own.
        extract: Whether each trial pulls the key out again after the verdict. Costs time and
            decides nothing in simulation, where each trial starts from a reset.

    Raises:
        ConfigError: If there is no such level or switch.
    """

    def __init__(
        self, name: str = "keylock", *, scene: Scene | None = None, extract: bool = False
    ) -> None:
        self._spec = keylock_spec(name)
        self._level = level(name)
        self._scene = scene
        self._extract = extract
        self._rows: Array | None = None

    @cached_property
    @abstractmethod
    def plant(self) -> P:
        """The simulation, built on first use."""

    @abstractmethod
    def execute(
        self, setup: Setup, job: Job, beat: Callable[[], None], rows: Array | None = None
    ) -> tuple[Decision, Array]:
        """Run one trial on the plant; see :func:`shearline.evaluator.skill.execute.execute`."""

    @property
    def spec(self) -> TaskSpec:
        """Name, space and options."""
        return self._spec

    @property
    def engine(self) -> str:
        """Engine, version, model hash and version of the skill; loads the engine."""
        return f"{self.plant.engine} skill {SKILL_VERSION}"

    def warm(self) -> None:
        """Load the engine, load or compile the loop, and run one trial."""
        space = (self._spec.space[name] for name in self._spec.space)
        centre = np.array([(low + high) / 2.0 for _, low, high in space])
        self.run(centre, _WARM_SEED, lambda: None)

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
        """Run one trial; see :class:`shearline.evaluator.base.Task`.

        Extras: ``depth_m`` and ``insertion_s`` (time since the mouth plane), ``trial_s`` (whole
        trial in its own time), ``offset_m`` and ``tilt_rad`` (how far off the lock really was).

        Raises:
            TrialAborted: If the simulation broke down before a verdict.
        """
        from shearline.evaluator.skill import execute, semantic, trace  # noqa: PLC0415
        from shearline.sims.plant import PlantError  # noqa: PLC0415
        from shearline.sims.scene import TICK_S  # noqa: PLC0415

        setup, off = draw_setup(self._level, seed)
        if self._rows is None:
            self._rows = np.empty((execute.TICKS_MAX, len(trace.COLUMNS)))
        job = self.job(theta)
        try:
            end, rows = self.execute(setup, job, beat, self._rows)
        except PlantError as error:
            raise TrialAborted(str(error)) from error
        return Outcome(
            cost=semantic.cost(end, job.limits, TICK_S),
            success=end.verdict == semantic.SUCCESS,
            digest=trace.digest(rows),
            extras={
                "depth_m": float(end.depth_m),
                "insertion_s": max(end.clock_ticks, 0) * TICK_S,
                "trial_s": len(rows) * TICK_S,
                "offset_m": float(np.linalg.norm(off[:3])),
                "tilt_rad": float(np.linalg.norm(off[3:])),
            },
            why=semantic.VERDICTS[end.verdict],
            trace=trace.trace(rows, end, TICK_S, (_placed(setup),)),
        )

    def scene(self) -> SceneData:
        """Return what a trial looks like: the arm, the key, the lock and its pins."""
        from shearline.evaluator.skill.trace import MOVED  # noqa: PLC0415
        from shearline.sims.geometry import geometry  # noqa: PLC0415
        from shearline.sims.lock import CUT  # noqa: PLC0415

        text = self.plant.scene.mjcf()
        return geometry(text, MOVED, tip_in="lock", front=CUT)

    def job(self, theta: Array) -> Job:
        """Return what a trial of ``theta (23,)`` is to do."""
        from shearline.evaluator.skill.control import arm  # noqa: PLC0415
        from shearline.evaluator.skill.execute import Job  # noqa: PLC0415
        from shearline.sims.scene import TICK_S, believed_lock_pose  # noqa: PLC0415

        return Job(
            p=parameters(theta),
            limits=self.limits(),
            arm=arm(believed_lock_pose(), TICK_S),
            extract=self._extract,
        )

    def limits(self) -> Limits:
        """Return what a trial of this level must not exceed."""
        from shearline.evaluator.skill.semantic import Limits  # noqa: PLC0415

        big, small = self._level.torque_big, self._level.torque_small
        return Limits(
            torque=np.array([big] * 4 + [small] * 3),
            roi_m=ROI_M,
            depth_m=self.plant.scene.lock.depth_m,
            cost_per_m=COST_PER_M,
        )


class KeylockTask(LockTask["MujocoPlant"]):
    """The task in MuJoCo, the engine that all figures are measured with unless they say so."""

    @cached_property
    def plant(self) -> MujocoPlant:
        """The simulation, built on first use."""
        from shearline.sims.mujoco_plant import MujocoPlant  # noqa: PLC0415 - see module

        return MujocoPlant(self._scene or scene_of(self._level))

    def execute(
        self, setup: Setup, job: Job, beat: Callable[[], None], rows: Array | None = None
    ) -> tuple[Decision, Array]:
        """Run one trial in a compiled loop."""
        from shearline.evaluator.skill.loop import execute_compiled  # noqa: PLC0415 - see module

        return execute_compiled(self.plant, setup, job, beat, rows)


class BulletKeylockTask(LockTask["BulletPlant"]):
    """The task in PyBullet."""

    @cached_property
    def plant(self) -> BulletPlant:
        """The simulation, built on first use."""
        from shearline.sims.bullet_plant import BulletPlant  # noqa: PLC0415 - see module

        return BulletPlant(self._scene or scene_of(self._level))

    def execute(
        self, setup: Setup, job: Job, beat: Callable[[], None], rows: Array | None = None
    ) -> tuple[Decision, Array]:
        """Run one trial tick by tick."""
        from shearline.evaluator.skill.execute import execute  # noqa: PLC0415 - see module

        return execute(self.plant, setup, job, beat, rows)


def _placed(setup: Setup) -> Placed:
    """Return where the lock stands in one trial."""
    from shearline.sims.scene import quaternion  # noqa: PLC0415

    w, x, y, z = quaternion(setup.lock.rotation).tolist()
    return Placed(body="lock", position=setup.lock.position.tolist(), quaternion=[x, y, z, w])
