"""Where the tip of a trial is to go, as far as a run's settings say it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Goal:
    """Where the tip is to go, in the frame of the lock.

    Attributes:
        depth_m: Depth that counts as inserted [m].
        roi_m: Radius of the region of interest around it [m].
    """

    depth_m: float
    roi_m: float

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Goal | None:
        """Return what a run's settings say of the goal, or ``None`` if they say nothing."""
        task = settings.get("task", {})
        options = task.get("options", {}) if isinstance(task, Mapping) else {}
        depth_m, roi_m = options.get("depth_m"), options.get("roi_m")
        if not isinstance(depth_m, float) or not isinstance(roi_m, float):
            return None
        return cls(depth_m, roi_m)
