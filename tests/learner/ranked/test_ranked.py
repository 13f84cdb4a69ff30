"""The ranked learner keeps the contract of all learners."""

from __future__ import annotations

from shearline.learner import Learner, Space, create
from shearline.learner.testing import LearnerContract


class TestRankedPSP(LearnerContract):
    def make(self, space: Space, episode_length: int, seed: int) -> Learner:
        return create("psp-ranked", space, episode_length, seed)
