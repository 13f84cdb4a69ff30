"""Holds two traces against each other, bit by bit, and says where they first part.

Samples are compared as the bits that stand on record: not a number equals itself here, and minus
zero is not zero. A recorded trace may have been thinned: then each of its samples must be among
those of the other, at equal steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.evaluator.base import Trace

Index = npt.NDArray[np.intp]
Values = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Difference:
    """Where two traces first part.

    Attributes:
        channel: The first channel to differ; among several at one time the first in order.
        unit: Its unit.
        t_s: When, on the trial's clock [s].
        recorded: Its value on record.
        replayed: Its value when run again.
        channels: How many channels differ at all.
    """

    channel: str
    unit: str
    t_s: float
    recorded: float
    replayed: float
    channels: int

    def __str__(self) -> str:
        """Say it in words, with as many digits as single precision has."""
        rest = f", and {self.channels - 1} more channels differ" if self.channels > 1 else ""
        off = abs(self.replayed - self.recorded)
        return (
            f"{self.channel} is the first to differ, at {self.t_s:.4f} s by {off:.3g} {self.unit}"
            f" ({self.recorded:.9g} recorded, {self.replayed:.9g} replayed){rest}"
        )


def compare(recorded: Trace, replayed: Trace) -> str:
    """Return in one clause how a trace on record differs from one run again, or ``""``."""
    named = [(name, unit) for name, (unit, _) in recorded.columns.items()]
    if named != [(name, unit) for name, (unit, _) in replayed.columns.items()]:
        return _other_channels(recorded, replayed)
    kept = alignment(recorded.t_s, replayed.t_s)
    if kept is None:
        shared = min(recorded.t_s.size, replayed.t_s.size)
        found = first_difference(recorded, replayed, np.arange(shared))
        return str(found) if found else _other_length(recorded, replayed)
    found = first_difference(recorded, replayed, kept)
    if found:
        return str(found)
    return _other_events(recorded, replayed) or _other_places(recorded, replayed)


def first_difference(recorded: Trace, replayed: Trace, kept: Index) -> Difference | None:
    """Return where the first samples of two traces with the same channels first differ.

    Args:
        recorded: On record.
        replayed: Run again, at least as long as ``kept`` asks.
        kept: Samples ``(n,)`` of ``replayed`` that stand opposite the first ``n`` on record.
    """
    firsts: dict[str, int] = {}
    for name, (_, mine) in _with_clock(recorded).items():
        other = _with_clock(replayed)[name][1][kept]
        differs = np.flatnonzero(bits(mine[: kept.size]) != bits(other))
        if differs.size:
            firsts[name] = int(differs[0])
    if not firsts:
        return None
    channel = min(firsts, key=lambda name: firsts[name])
    at = firsts[channel]
    unit, mine = _with_clock(recorded)[channel]
    return Difference(
        channel=channel,
        unit=unit,
        t_s=float(replayed.t_s[kept[at]]),
        recorded=float(mine[at]),
        replayed=float(_with_clock(replayed)[channel][1][kept[at]]),
        channels=len(firsts),
    )


def alignment(recorded_s: Values, replayed_s: Values) -> Index | None:
    """Return the samples of a trace that a recorded one, whole or thinned, should hold.

    Args:
        recorded_s: Clock on record ``(n,)`` [s].
        replayed_s: Clock of the trace run again ``(m,)`` [s].

    Returns:
        Indices ``(n,)`` into the second; ``None`` if no equal step makes ``n`` of ``m`` samples.
    """
    n, m = recorded_s.size, replayed_s.size
    if n == m:
        return np.arange(m)
    if n < 2 or n > m:
        return None
    step = int(np.searchsorted(replayed_s, recorded_s[1]))
    every = np.arange(0, m, max(step, 1))
    ends = every if every[-1] == m - 1 else np.append(every, m - 1)
    return next((kept for kept in (every, ends) if kept.size == n), None)


def bits(values: Values) -> npt.NDArray[np.uint32]:
    """Return the bits of single-precision numbers ``(n,)``."""
    return np.ascontiguousarray(values, dtype="<f4").view(np.uint32)


def _with_clock(trace: Trace) -> dict[str, tuple[str, Values]]:
    return {"t_s": ("s", trace.t_s), **trace.columns}


def _other_channels(recorded: Trace, replayed: Trace) -> str:
    pairs = zip(recorded.columns.items(), replayed.columns.items(), strict=False)
    for (name, (unit, _)), (other, (other_unit, _)) in pairs:
        if (name, unit) != (other, other_unit):
            return f"channel {name} [{unit}] on record is {other} [{other_unit}] here"
    return f"{len(recorded.columns)} channels are on record, {len(replayed.columns)} here"


def _other_length(recorded: Trace, replayed: Trace) -> str:
    return (
        f"{recorded.t_s.size} samples are on record, {replayed.t_s.size} come out here; they agree"
        " until the shorter one ends"
    )


def _other_events(recorded: Trace, replayed: Trace) -> str:
    was, found = tuple(recorded.events), tuple(replayed.events)
    if was == found:
        return ""
    for (was_s, name), (at_s, other) in zip(was, found, strict=False):
        if (was_s, name) != (at_s, other):
            return f"the event {name} at {was_s:.4f} s on record is {other} at {at_s:.4f} s here"
    return f"{len(was)} events are on record, {len(found)} here"


def _other_places(recorded: Trace, replayed: Trace) -> str:
    """Older records do not say where bodies stood; those that do must be right."""
    here = {placed.body: placed for placed in replayed.placed}
    for placed in recorded.placed:
        if here.get(placed.body) != placed:
            return f"{placed.body} stood elsewhere on record than here"
    return ""
