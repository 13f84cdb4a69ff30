"""A film of a replayed key-in-lock trial: the arm, the lock cut open, depth and force over time.

Nothing is simulated here: joints and pins are those of the trace, the lock stands where the seed
put it. Pictures come from :mod:`shearline.sims.render`, their frame from
:mod:`shearline.evaluator.replay.strip`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shearline.evaluator.base import Array, Trace
from shearline.evaluator.keylock_draw import draw_setup, scene_of
from shearline.evaluator.keylock_variation import LEVELS, is_keylock, level
from shearline.evaluator.replay.again import Replayed
from shearline.evaluator.replay.strip import CAPTION_HEIGHT, Strip, caption
from shearline.evaluator.replay.strip import HEIGHT as STRIP_HEIGHT
from shearline.evaluator.replay.video import FPS, Image
from shearline.protocol.errors import ConfigError
from shearline.sims import render

#: A film is this large [pixels]: a caption, two views side by side, a strip.
WIDTH, HEIGHT = 1280, 720
_VIEW_HEIGHT = HEIGHT - STRIP_HEIGHT - CAPTION_HEIGHT
_SCENE_WIDTH = 740
_CUT_WIDTH = WIDTH - _SCENE_WIDTH

#: The arm from nearer than in a still picture: what moves are hand and key.
_NEAR = render.Camera((0.34, 0.0, 0.33), 1.36, 142.0, -14.0, shadow=True)

#: Finer shadows take twice the time of all else and look the same once encoded [pixels].
_SHADOW_PIXELS = 2048

#: The last picture stays for so long, so that the verdict can be read [s].
_HOLD_S = 1.0


def check_filmable(task: str) -> None:
    """Raise if a task has no scene to film.

    Raises:
        ConfigError: With the names of the tasks that have one.
    """
    if not is_keylock(task):
        raise ConfigError(
            f"expected a task with a scene ({', '.join(LEVELS)}), this run has {task}"
        )


class Film:
    """The pictures of one trial, in order; iterate over it, once or again.

    Args:
        replayed: A key-in-lock trial.
        speed: 1 is real time, .25 is slow motion.

    Raises:
        ConfigError: If the trial has no trace, or its task no scene.
    """

    def __init__(self, replayed: Replayed, speed: float) -> None:
        check_filmable(replayed.case.task.name)
        trace = replayed.verdict.trace
        if trace is None:
            raise ConfigError(
                f"trial {replayed.case.trial} ended without a trace ({replayed.verdict.why}):"
                " there is nothing to film"
            )
        self._trace = trace
        self._level = level(replayed.case.task.name)
        self._setup, _ = draw_setup(self._level, replayed.seed)
        self._caption = caption(replayed, speed, WIDTH)
        step_s = speed / FPS
        times_s = np.arange(0.0, float(trace.t_s[-1]), step_s)
        kept = np.searchsorted(trace.t_s, times_s)
        self._samples = [*kept.tolist(), len(trace.t_s) - 1]

    def __len__(self) -> int:
        return len(self._samples) + round(_HOLD_S * FPS)

    def __iter__(self) -> Iterator[Image]:
        """Yield pictures ``(720, 1280, 3)``.

        Raises:
            RenderError: If none can be drawn on this machine.
        """
        from shearline.sims.mujoco_plant import MujocoPlant  # noqa: PLC0415 - loads the engine

        plant = MujocoPlant(scene_of(self._level))
        plant.model.vis.quality.shadowsize = _SHADOW_PIXELS
        plant.reset(self._setup)
        postures = _postures(self._trace, plant.scene.grip_joints)
        strip = Strip(self._trace, WIDTH)
        with (
            render.Stage(plant, _NEAR, _SCENE_WIDTH, _VIEW_HEIGHT) as scene,
            render.Stage(plant, render.into_lock(self._setup), _CUT_WIDTH, _VIEW_HEIGHT) as cut,
        ):
            for sample in self._samples:
                posture = postures[sample]
                views = np.concatenate([scene.draw(posture), cut.draw(posture)], axis=1)
                picture = np.concatenate([self._caption, views, strip.at(sample)])
                yield picture
        for _ in range(len(self) - len(self._samples)):
            yield picture


def _postures(trace: Trace, grip_joints: int) -> Array:
    """Return joints and pins ``(samples, 12)`` [rad, m].

    Traces say nothing of how the key turns between pads that give: there it is drawn unloaded.
    """
    arm, pins = (
        [values for name, (_, values) in trace.columns.items() if name.startswith(kind)]
        for kind in ("q.", "pin.")
    )
    still = [np.zeros(len(trace.t_s))] * grip_joints
    return np.stack([*arm, *still, *pins], axis=1).astype(np.float64)
