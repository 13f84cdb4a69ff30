"""What the columns of a trace are, judged by their names: groups, tips, forces.

A dot groups: ``tau_ext.1`` to ``tau_ext.7`` are one group in one unit. Any task may name its
columns as it likes; some names get more than a chart. Nothing is drawn here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from shearline.record import charts
from shearline.record.reader import Array, Trace

#: Groups that people tune by, in the order in which charts are given to them.
FIRST = ("depth", "push_wiggle", "tau_ext", "wrench", "force", "speed")
#: Heads whose peaks matter when a trace is thinned.
LOOKED_AT = frozenset({"depth", "push", "wiggle", "tau_ext", "wrench", "force", "speed", "tip"})
#: Shown in space or as a state, not as curves.
NOT_CURVES = frozenset({"tip", "phase"})
#: Groups that are read together, by head and unit.
TOGETHER = {("push", "N"): "push_wiggle", ("wiggle", "N"): "push_wiggle"}
#: Lengths of a key's size are read in millimetres.
MILLIMETRES = frozenset({"depth", "offset", "error", "pin", "reference"})
#: Names of a force at the tip, tried in this order.
_FORCES = (
    ("wrench.fx", "wrench.fy", "wrench.fz"),
    ("wrench.x", "wrench.y", "wrench.z"),
    ("force.x", "force.y", "force.z"),
)

#: Group to one limit per column, in the column's unit.
Limits = Mapping[str, Sequence[float]]


@dataclass(frozen=True, slots=True)
class Group:
    """Columns that belong together.

    Attributes:
        name: What stands before the dot, with the unit where one head has two.
        unit: Of all of them.
        names: One per column.
        values: One ``(samples,)`` per column.
    """

    name: str
    unit: str
    names: list[str]
    values: list[Array]


def groups(trace: Trace, limits: Limits | None = None) -> list[Group]:
    """Return the curves of a trace in groups, those that people tune by first.

    Args:
        trace: With columns of any names.
        limits: Columns of these groups are given in per cent of their limit.
    """
    found: dict[str, Group] = {}
    for column, (unit, values) in trace.columns.items():
        head = column.split(".", 1)[0]
        if head in NOT_CURVES:
            continue
        name = TOGETHER.get((head, unit), head)
        if name in found and found[name].unit != unit:
            name = f"{name}_{unit.replace(' ', '')}"
        group = found.setdefault(name, Group(name, unit, [], []))
        group.names.append(column)
        group.values.append(values)
    readable = [_readable(group, (limits or {}).get(group.name)) for group in found.values()]
    return sorted(readable, key=lambda group: _rank(group.name))


def limits_of(settings: Mapping[str, Any]) -> Limits:
    """Return the torque limits that a run's settings name, joints 1 to 4 and 5 to 7 [N m]."""
    task = settings.get("task", {})
    options = task.get("options", {}) if isinstance(task, Mapping) else {}
    big, small = options.get("torque_big"), options.get("torque_small")
    if not isinstance(big, float) or not isinstance(small, float):
        return {}
    return {"tau_ext": [big] * 4 + [small] * 3}


def plain(trace: Trace) -> dict[str, Array]:
    """Return the columns without their units."""
    return {name: values for name, (_, values) in trace.columns.items()}


def thinned(trace: Trace, n: int) -> Trace:
    """Return ``n`` samples of a trace that keep the peaks of what is looked at, and the end.

    A shorter trace is filled up with its last sample, so that all thinned ones are of one length.
    """
    looked_at = [
        values for name, (_, values) in trace.columns.items() if name.split(".", 1)[0] in LOOKED_AT
    ]
    kept = charts.telling(looked_at or [trace.t_s], n)
    kept = np.pad(kept, (0, n - len(kept)), mode="edge")
    values = np.stack([trace.t_s, *plain(trace).values()])[:, kept]
    named = zip(trace.columns.items(), values[1:], strict=True)
    return Trace(
        trial=trace.trial,
        token=trace.token,
        t_s=values[0],
        columns={name: (unit, thin) for (name, (unit, _)), thin in named},
        events=trace.events,
        placed=trace.placed,
    )


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


def in_lock(trace: Trace) -> bool:
    """Tell whether the tip is given in the frame of the lock, its z being the depth."""
    if not {"tip.z", "depth"} <= set(trace.columns):
        return False
    return np.array_equal(trace.columns["tip.z"][1], trace.columns["depth"][1])


def _readable(group: Group, limits: Sequence[float] | None) -> Group:
    if limits is not None and len(limits) == len(group.values):
        shares = [
            values * np.float32(100.0 / limit)
            for values, limit in zip(group.values, limits, strict=True)
        ]
        return Group(group.name, "% of limit", group.names, shares)
    if group.unit == "m" and group.name in MILLIMETRES:
        millimetres = [values * np.float32(1000.0) for values in group.values]
        return Group(group.name, "mm", group.names, millimetres)
    return group


def _stacked(trace: Trace, names: tuple[str, ...]) -> npt.NDArray[np.float32] | None:
    if not set(names) <= set(trace.columns):
        return None
    return np.stack([trace.columns[name][1] for name in names], axis=1)


def _rank(name: str) -> int:
    return FIRST.index(name) if name in FIRST else len(FIRST)
