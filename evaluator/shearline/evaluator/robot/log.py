"""The robot's 1 kHz log of a trial: counted, kept, and turned into a trace.

The columns that simulated trials have as well bear the same names, so that a record shows both
side by side. What the skill commanded is known at the rate of the references and held in between.
"""

from __future__ import annotations

import hashlib

import numpy as np

from shearline.evaluator.base import Trace
from shearline.evaluator.robot.frames import inverse
from shearline.evaluator.robot.port import LOG_STEP_S, Array, log_columns
from shearline.evaluator.robot.trial import Report
from shearline.evaluator.skill.semantic import OPEN, PHASES, VERDICTS
from shearline.protocol.pose import Placed

#: Columns of a report's notes behind time and phase.
_NOTED = (
    ("reference.x", "m"),
    ("reference.y", "m"),
    ("push", "N"),
    ("wiggle.x", "N"),
    ("wiggle.y", "N"),
    ("wiggle.rx", "N m"),
    ("wiggle.ry", "N m"),
)
_WRENCH = (("fx", "N"), ("fy", "N"), ("fz", "N"), ("mx", "N m"), ("my", "N m"), ("mz", "N m"))


def missing(log: Array, stretches: list[tuple[float, float]]) -> int:
    """Return how many cycles the log lacks within the contacts, each ``(first, last)`` [s].

    Distinct milliseconds are counted: a row that stands there twice makes up for none.
    """
    t_s = log[:, 0]
    lacking = 0
    for first_s, last_s in stretches:
        inside = t_s[(t_s >= first_s - 1e-6) & (t_s <= last_s + 1e-6)]
        cycles = np.unique(np.round((inside - first_s) / LOG_STEP_S)).size
        lacking += max(0, round((last_s - first_s) / LOG_STEP_S) + 1 - cycles)
    return lacking


def digest(log: Array) -> str:
    """Return 32 hexadecimal digits of a log, to the last bit."""
    return hashlib.sha256(np.ascontiguousarray(log).tobytes()).hexdigest()[:32]


def trace(log: Array, joints: int, report: Report, o_t_lock: Array) -> Trace | None:
    """Return a log ``(rows, columns)`` as a trace, ``None`` if nothing was logged."""
    if len(log) == 0:
        return None
    named = {name: log[:, i] for i, name in enumerate(log_columns(joints))}
    t_s = log[:, 0]
    columns: dict[str, tuple[str, Array]] = {}
    for ours, theirs, unit in (
        ("q", "q", "rad"),
        ("dq", "dq", "rad/s"),
        ("tau", "tau_j", "N m"),
        ("tau_ext", "tau_ext", "N m"),
    ):
        for j in range(joints):
            columns[f"{ours}.{j + 1}"] = (unit, named[f"{theirs}.{j + 1}"])
    tip = _tip(named, o_t_lock)
    for axis, values in zip("xyz", tip.T, strict=True):
        columns[f"tip.{axis}"] = ("m", values)
    columns |= _noted(t_s, report)
    columns |= _wrench(named, o_t_lock)
    columns["depth"] = ("m", tip[:, 2])
    return Trace(
        t_s=(t_s - t_s[0]).astype(np.float32),
        columns={n: (u, np.ascontiguousarray(v, np.float32)) for n, (u, v) in columns.items()},
        events=_events(t_s[0], tip[:, 2], t_s, report),
        placed=(_placed(o_t_lock),),
    )


def _tip(named: dict[str, Array], o_t_lock: Array) -> Array:
    """Return the tip in the frame of the lock ``(rows, 3)`` [m]."""
    position = np.stack([named[f"o_t_ee.{row}3"] for row in range(3)], axis=1)
    back = inverse(o_t_lock)
    placed: Array = position @ back[:3, :3].T + back[:3, 3]
    return placed


def _wrench(named: dict[str, Array], o_t_lock: Array) -> dict[str, tuple[str, Array]]:
    felt = np.stack([named[f"o_f_ext.{axis}"] for axis, _ in _WRENCH], axis=1)
    turn = o_t_lock[:3, :3]
    turned = np.concatenate([felt[:, :3] @ turn, felt[:, 3:] @ turn], axis=1)
    return {f"wrench.{axis}": (unit, turned[:, i]) for i, (axis, unit) in enumerate(_WRENCH)}


def _noted(t_s: Array, report: Report) -> dict[str, tuple[str, Array]]:
    """Hold each tick's note until the next one."""
    names = (("phase", ""), *_NOTED)
    if not report.notes:
        return {name: (unit, np.zeros(len(t_s))) for name, unit in names}
    notes = np.array(report.notes)
    at = np.clip(np.searchsorted(notes[:, 0], t_s, side="right") - 1, 0, None)
    before = t_s < notes[0, 0]
    held = {}
    for i, (name, unit) in enumerate(names):
        held[name] = (unit, np.where(before, 0.0, notes[at, 1 + i]))
    return held


def _events(
    zero_s: float, depth: Array, t_s: Array, report: Report
) -> tuple[tuple[float, str], ...]:
    """Return phase changes, the crossing of the mouth plane and the verdict, in order."""
    events = [(0.0, PHASES[0])]
    phase = 0
    for note in report.notes:
        if int(note[1]) != phase:
            phase = int(note[1])
            events.append((note[0] - zero_s, PHASES[phase]))
    inside = np.flatnonzero(depth >= 0.0)
    if inside.size:
        events.append((float(t_s[inside[0]]) - zero_s, "mouth"))
    if report.end.verdict != OPEN:
        ended_s = next((n[0] for n in report.notes if n[1] > 2), report.notes[-1][0])
        events.append((ended_s - zero_s, VERDICTS[report.end.verdict] or "success"))
    return tuple(sorted(events, key=lambda event: event[0]))


def _placed(o_t_lock: Array) -> Placed:
    from shearline.sims.scene import quaternion  # noqa: PLC0415 - only records need it

    w, x, y, z = quaternion(o_t_lock[:3, :3]).tolist()
    return Placed(body="lock", position=o_t_lock[:3, 3].tolist(), quaternion=[x, y, z, w])
