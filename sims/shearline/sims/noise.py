"""What the torque sensors of the arm add to the truth in one trial."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shearline.sims.panda import JOINTS, Array


@dataclass(frozen=True, slots=True)
class TorqueNoise:
    """An error that stays, and one that is new in every tick.

    Attributes:
        bias: Constant error of each joint ``(7,)`` [N m].
        sigma: Standard deviation of what is added in each tick [N m].
        seed: Of the latter.
    """

    bias: tuple[float, ...]
    sigma: float
    seed: int

    def samples(self, ticks: int) -> Array:
        """Return what is added to the contact torques, tick by tick ``(ticks, 7)`` [N m]."""
        white = np.random.default_rng(self.seed).standard_normal((ticks, JOINTS))
        added: Array = np.array(self.bias) + self.sigma * white
        return added
