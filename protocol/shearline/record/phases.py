"""How long each phase of one traced attempt took, from its events and its ``phase`` column.

Some events are landmarks within a phase and a verdict ends the last one; where a trace carries a
``phase`` column, only events at which it changes begin a phase. What phases mean is the task's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shearline.protocol.messages import TraceData

#: Clocks on record are float32: an event this close to a sample is at it [s].
SAME_S = 1e-4


@dataclass(frozen=True, slots=True)
class Phase:
    """One phase of a trial.

    Attributes:
        name: The task's name for it.
        start_s: On the trial's clock [s].
        end_s: Likewise [s]; at least ``start_s``.
    """

    name: str
    start_s: float
    end_s: float


def phases_of(trace: TraceData) -> tuple[Phase, ...]:
    """Return the phases of a trace in order, those that took no time left out."""
    if not trace.samples or not trace.events:
        return ()
    columns = np.frombuffer(trace.data, dtype="<f4").reshape(len(trace.names), trace.samples)
    clock = columns[0]
    column = columns[trace.names.index("phase")] if "phase" in trace.names else None
    starts: list[tuple[float, str]] = []
    for at_s, name in trace.events:
        # of two events at one time, the first begins the phase and the second is its landmark
        again = bool(starts) and at_s <= starts[-1][0] + SAME_S
        if column is None or (not again and _new(column, clock, at_s)):
            starts.append((at_s, name))
    ends = [at_s for at_s, _ in starts[1:]] + [float(clock[-1])]
    return tuple(
        Phase(name, at_s, end_s)
        for (at_s, name), end_s in zip(starts, ends, strict=True)
        if end_s > at_s + SAME_S
    )


def _new(phase: np.ndarray, clock: np.ndarray, at_s: float) -> bool:
    """Tell whether another phase than before holds at the first sample from ``at_s`` on."""
    sample = int(np.searchsorted(clock, at_s - SAME_S))
    return sample == 0 or (sample < len(phase) and bool(phase[sample] != phase[sample - 1]))
