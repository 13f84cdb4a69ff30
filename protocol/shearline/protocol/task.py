"""What is being learned, as both sides must mean it. How a trial is run is not known here."""

from __future__ import annotations

import hashlib
from typing import Annotated

import msgspec
from msgspec import Meta


class TaskSpec(msgspec.Struct, frozen=True, kw_only=True):
    """What is being learned; both sides must mean the same thing by it.

    Attributes:
        name: ``"keylock"`` or the user's ``"file:function"``.
        space: Parameter name to ``(unit, low, high)``, in order.
        options: Whatever else decides the cost (level, limits), by name.
        trial_s: Longest wall time one trial may take before it counts as hung [s].
    """

    name: Annotated[str, Meta(min_length=1, max_length=256)]
    space: Annotated[dict[str, tuple[str, float, float]], Meta(min_length=1, max_length=1024)]
    options: dict[str, str | float | bool] = {}
    trial_s: Annotated[float, Meta(gt=0.0, le=86400.0)] = 60.0


def digest(task: TaskSpec) -> str:
    """Return 16 hexadecimal digits that differ when what is being learned differs.

    The order of parameters is part of it, since a tuple has no names; that of options is not.
    """
    facts = (task.name, list(task.space.items()), sorted(task.options.items()), task.trial_s)
    return hashlib.sha256(msgspec.json.encode(facts)).hexdigest()[:16]
