"""What the columns of a trace are, judged by their names: groups, tips, forces.

A dot groups: ``tau_ext.1`` to ``tau_ext.7`` are one group in one unit. Any task may name its
columns as it likes; some names get more than a chart. Nothing is drawn here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.record.reader import Array, Trace

#: Groups that people tune by, in the order in which charts are given to them.
FIRST = ("depth", "push", "wiggle", "tau_ext", "wrench", "force", "speed")
#: Shown in space, not as charts.
SPATIAL = frozenset({"tip", "quat", "lock"})
#: Lengths of this task's size are read in millimetres.
MILLIMETRES = frozenset({"depth", "offset", "error"})
#: Names of a force at the tip, tried in this order.
_FORCES = (
    ("wrench.fx", "wrench.fy", "wrench.fz"),
    ("wrench.x", "wrench.y", "wrench.z"),
    ("force.x", "force.y", "force.z"),
)


@dataclass(frozen=True, slots=True)
class Group:
    """Columns that belong together.

    Attributes:
        name: What stands before the dot.
        unit: Of all of them.
        names: One per column.
        values: One ``(samples,)`` per column.
    """

    name: str
    unit: str
    names: list[str]
    values: list[Array]


def groups(trace: Trace) -> list[Group]:
    """Return the groups of a trace, those that people tune by first."""
    found: dict[tuple[str, str], Group] = {}
    for name, (unit, values) in trace.columns.items():
        head = name.split(".", 1)[0]
        if unit == "m" and head in MILLIMETRES:
            unit, values = "mm", values * np.float32(1000.0)  # noqa: PLW2901 - in people's unit
        group = found.setdefault((head, unit), Group(head, unit, [], []))
        group.names.append(name)
        group.values.append(values)
    return sorted(found.values(), key=lambda group: _rank(group.name))


def tip(trace: Trace) -> npt.NDArray[np.float32] | None:
    """Return the path of the tip ``(samples, 3)`` [m], or ``None`` if the trace has none."""
    return _stacked(trace, ("tip.x", "tip.y", "tip.z"))


def force(trace: Trace) -> npt.NDArray[np.float32] | None:
    """Return the force at the tip ``(samples, 3)`` [N], or ``None`` if the trace has none."""
    for names in _FORCES:
        stacked = _stacked(trace, names)
        if stacked is not None:
            return stacked
    return None


def _stacked(trace: Trace, names: tuple[str, ...]) -> npt.NDArray[np.float32] | None:
    if not set(names) <= set(trace.columns):
        return None
    return np.stack([trace.columns[name][1] for name in names], axis=1)


def _rank(name: str) -> int:
    return FIRST.index(name) if name in FIRST else len(FIRST)
