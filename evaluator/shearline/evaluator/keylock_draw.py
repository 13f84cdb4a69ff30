"""What differs from trial to trial: drawn from the trial's seed, the same for every engine."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from shearline.evaluator.base import Array
from shearline.evaluator.keylock_variation import Level

if TYPE_CHECKING:
    from shearline.sims.plant import Setup
    from shearline.sims.scene import Scene

#: Parts what switches draw from what the plain levels draw, so that one leaves the other alone:
#: a seed's lock stands in the same place with and without.
_SWITCHED_KEY = 0x6719


def draw_setup(chosen: Level, seed: int) -> tuple[Setup, Array]:
    """Draw what differs in the trial with this seed.

    Returns:
        The setup, and the lock's true pose off the believed one ``(6,)`` [m, rad].
    """
    from shearline.sims.lock import PINS  # noqa: PLC0415 - with the task
    from shearline.sims.plant import Setup  # noqa: PLC0415
    from shearline.sims.scene import believed_lock_pose  # noqa: PLC0415

    rng = np.random.default_rng(seed)
    off = np.clip(rng.standard_normal(6), -2.0, 2.0)
    off[:3] *= chosen.offset_m
    off[3:] *= chosen.tilt_rad
    friction = None if chosen.friction is None else float(rng.uniform(*chosen.friction))
    spread = chosen.pin_spread
    scale = tuple(float(f) for f in rng.uniform(1.0 - spread, 1.0 + spread, PINS))
    pose = believed_lock_pose().moved(off[:3], off[3:])
    return _switched(Setup(lock=pose, friction=friction, pin_scale=scale), chosen, seed), off


def _switched(setup: Setup, chosen: Level, seed: int) -> Setup:
    """Return a setup with what the switches draw; every switch has its own numbers."""
    from shearline.sims.noise import TorqueNoise  # noqa: PLC0415 - with the task
    from shearline.sims.panda import JOINTS  # noqa: PLC0415

    grasp, pads, sensors = np.random.default_rng([_SWITCHED_KEY, seed]).spawn(3)
    if chosen.grip_m or chosen.grip_rad:
        y, z, turn = np.clip(grasp.standard_normal(3), -2.0, 2.0).tolist()
        grip = (0.0, y * chosen.grip_m, z * chosen.grip_m, turn * chosen.grip_rad, 0.0, 0.0)
        setup = replace(setup, grip=grip)
    if chosen.pad_factor:
        power = float(pads.uniform(-1.0, 1.0))
        setup = replace(setup, pad_scale=math.pow(chosen.pad_factor, power))
    if chosen.bias_nm or chosen.noise_nm:
        bias = chosen.bias_nm * np.clip(sensors.standard_normal(JOINTS), -2.0, 2.0)
        white = int(sensors.integers(2**63))
        noise = TorqueNoise(tuple(bias.tolist()), chosen.noise_nm, white)
        setup = replace(setup, noise=noise)
    return setup


def scene_of(chosen: Level) -> Scene:
    """Return the scene of a level: its key and lock, and how the key is held."""
    from shearline.sims.grasp import Grasp, rubber  # noqa: PLC0415 - with the task
    from shearline.sims.lock import KEYS, Lock  # noqa: PLC0415
    from shearline.sims.scene import Scene  # noqa: PLC0415

    held = None if chosen.holds_rigidly else rubber() if chosen.pad_factor else Grasp()
    return Scene(lock=Lock(key=KEYS[chosen.key]), grasp=held)
