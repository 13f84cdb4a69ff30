"""What is kept of every tick: the columns, and how a row of them is written.

Rows are float64 and their digest proves that a trial came out the same to the last bit; people and
the record get the same columns as float32.
"""

from __future__ import annotations

import hashlib

import numpy as np

from shearline.evaluator.base import Trace
from shearline.evaluator.skill.semantic import PHASES, VERDICTS, Decision
from shearline.evaluator.skill.skill import State
from shearline.protocol.pose import Placed
from shearline.sims.compiled import compiled
from shearline.sims.lock import PINS
from shearline.sims.panda import JOINTS, Array


def _joints(name: str, unit: str) -> list[tuple[str, str]]:
    return [(f"{name}.{j + 1}", unit) for j in range(JOINTS)]


#: ``(name, unit)`` of every column.
COLUMNS: tuple[tuple[str, str], ...] = (
    *_joints("q", "rad"),
    *_joints("dq", "rad/s"),
    *_joints("tau", "N m"),
    *_joints("tau_ext", "N m"),
    *((f"tip.{axis}", "m") for axis in "xyz"),
    ("reference.x", "m"),
    ("reference.y", "m"),
    ("push", "N"),
    ("wiggle.x", "N"),
    ("wiggle.y", "N"),
    ("wiggle.rx", "N m"),
    ("wiggle.ry", "N m"),
    *((f"wrench.{axis}", "N") for axis in ("fx", "fy", "fz")),
    *((f"wrench.{axis}", "N m") for axis in ("mx", "my", "mz")),
    ("depth", "m"),
    ("phase", ""),
    *((f"pin.{i + 1}", "m") for i in range(PINS)),
)

#: Joint of the scene to the column that moves it.
MOVED = {
    **{f"link{j + 1}": f"q.{j + 1}" for j in range(JOINTS)},
    **{f"pin{i}": f"pin.{i + 1}" for i in range(PINS)},
}

#: Columns before the tip's.
_TIP = 4 * JOINTS

#: Columns before the depth.
_DEPTH = _TIP + 16


@compiled
def write_row(row: Array, state: State, now: Decision) -> None:
    """Write one tick into ``row``, in the order of :data:`COLUMNS`."""
    percept, f, c = state.percept, state.feel, state.command
    for j in range(JOINTS):
        row[j] = percept.q[j]
        row[JOINTS + j] = percept.dq[j]
        row[2 * JOINTS + j] = f.tau[j]
        row[3 * JOINTS + j] = f.tau_ext[j]
    for i in range(3):
        row[_TIP + i] = percept.in_lock[i]
    row[_TIP + 3] = c.x[0]
    row[_TIP + 4] = c.x[1]
    row[_TIP + 5] = c.wrench[2]
    row[_TIP + 6] = c.wrench[0]
    row[_TIP + 7] = c.wrench[1]
    row[_TIP + 8] = c.wrench[3]
    row[_TIP + 9] = c.wrench[4]
    for i in range(6):
        row[_TIP + 10 + i] = f.wrench[i]
    row[_DEPTH] = percept.in_lock[2]
    row[_DEPTH + 1] = now.phase
    for i in range(PINS):
        row[_DEPTH + 2 + i] = percept.pins[i]


def digest(rows: Array) -> str:
    """Return 32 hexadecimal digits of the rows ``(ticks, columns)``, to the last bit."""
    return hashlib.sha256(np.ascontiguousarray(rows).tobytes()).hexdigest()[:32]


def trace(rows: Array, end: Decision, tick_s: float, placed: tuple[Placed, ...] = ()) -> Trace:
    """Return the rows ``(ticks, columns)`` as a trace with named columns and events."""
    values = np.ascontiguousarray(rows.T, dtype=np.float32)
    t_s = np.arange(len(rows), dtype=np.float32) * np.float32(tick_s)
    columns = {name: (unit, values[i]) for i, (name, unit) in enumerate(COLUMNS)}
    return Trace(t_s=t_s, columns=columns, events=_events(rows, end, tick_s), placed=placed)


def _events(rows: Array, end: Decision, tick_s: float) -> tuple[tuple[float, str], ...]:
    """Return phase changes, the crossing of the mouth plane and the verdict, in order."""
    phase, depth = rows[:, _DEPTH + 1].astype(int), rows[:, _DEPTH]
    starts = np.flatnonzero(np.diff(phase, prepend=-1))
    events = [(float(tick) * tick_s, PHASES[phase[tick]]) for tick in starts]
    inside = np.flatnonzero(depth >= 0.0)
    if end.clock_ticks >= 0 and inside.size:
        events.append((float(inside[0]) * tick_s, "mouth"))
    verdict = VERDICTS[end.verdict] or "success"
    events.append((_verdict_tick(rows, phase) * tick_s, verdict))
    return tuple(sorted(events, key=lambda event: event[0]))


def _verdict_tick(rows: Array, phase: np.ndarray) -> float:
    after = np.flatnonzero(phase > 2)
    return float(after[0]) if after.size else float(len(rows) - 1)
