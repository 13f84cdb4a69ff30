"""What an evaluator shows to observers: traces at the rate asked for, and what they look like.

Observers are served last and in measure: a trace too large for one message is thinned until it
fits, and one evaluator never offers more bytes a second than a budget. Nothing here sends, and no
trial waits for it.
"""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from typing import Protocol, runtime_checkable

from shearline.evaluator.base import Trace
from shearline.evaluator.local import trace_data
from shearline.protocol.codec import BULK_BYTES_MAX
from shearline.protocol.messages import Message, TraceData
from shearline.protocol.scene import SceneData

log = logging.getLogger(__name__)

#: Samples a second that are shown: as many as a controller has ticks [Hz].
TRACE_HZ = 1000.0
#: What traces may take of a message; the rest is for names and events.
TRACE_BYTES_MAX = BULK_BYTES_MAX - 2**17
#: What one evaluator offers to observers: ten key-locks at full rate [bytes/s].
BYTES_PER_S = 32 * 2**20
#: The scene is said again after this long, for observers that came meanwhile [s].
SCENE_S = 10.0


@runtime_checkable
class Seen(Protocol):
    """A task that knows what its trials look like."""

    def scene(self) -> SceneData:
        """Return the bodies, and which columns of a trace move them."""
        ...


class Showing:
    """Decides what observers get of each trial.

    Args:
        trace_hz: Samples of a trace per second of the trial's clock, at most.
        bytes_per_s: Budget of all that is shown.
    """

    def __init__(self, trace_hz: float = TRACE_HZ, bytes_per_s: float = BYTES_PER_S) -> None:
        self._trace_hz = trace_hz
        self._bytes_per_s = bytes_per_s
        # a burst of one full message is admitted at any time
        self._allowed_bytes = float(BULK_BYTES_MAX)
        self._since_s = -math.inf
        self._scene_s = -math.inf
        self._skipped = 0

    def messages(
        self, task: object, trace: Trace, trial: int, token: str, now_s: float
    ) -> list[Message]:
        """Return what to show of one trial.

        Args:
            task: Asked for its scene, if it has one.
            trace: The trial's.
            trial: Its number.
            token: The attempt's.
            now_s: Any clock that runs on [s].

        Raises:
            ValueError: If the trace is malformed.
        """
        shown: list[Message] = []
        if isinstance(task, Seen) and now_s - self._scene_s >= SCENE_S:
            self._scene_s = now_s
            shown.append(task.scene())
        message = trace_data(thinned(trace, self._trace_hz, TRACE_BYTES_MAX), trial, token)
        if self._admits(message, now_s):
            shown.append(message)
        return shown

    def _admits(self, message: TraceData, now_s: float) -> bool:
        """Tell whether the budget has room for a trace, and say how many it had none for."""
        gained = (now_s - self._since_s) * self._bytes_per_s
        self._allowed_bytes = min(float(BULK_BYTES_MAX), self._allowed_bytes + gained)
        self._since_s = now_s
        if len(message.data) > self._allowed_bytes:
            self._skipped += 1
            if self._skipped & (self._skipped - 1) == 0:  # the 1st, 2nd, 4th, 8th, ...
                log.warning("%d traces not shown so far: too many bytes a second", self._skipped)
            return False
        self._allowed_bytes -= len(message.data)
        return True


def thinned(trace: Trace, trace_hz: float, bytes_max: int) -> Trace:
    """Return a trace of at most ``trace_hz`` samples a second and ``bytes_max`` bytes.

    Every k-th sample is kept: what is left is still evenly sampled.
    """
    samples = trace.t_s.size
    if samples < 2:
        return trace
    span_s = float(trace.t_s[-1] - trace.t_s[0])
    # a clock in float32 is not quite even: a rate within one in a thousand is the rate asked for
    by_rate = (samples - 1) / max(span_s, 1e-9) / trace_hz / 1.001
    by_size = 4.0 * samples * (1 + len(trace.columns)) / bytes_max
    step = max(1, math.ceil(by_rate), math.ceil(by_size))
    if step == 1:
        return trace
    columns = {name: (unit, values[::step]) for name, (unit, values) in trace.columns.items()}
    return replace(trace, t_s=trace.t_s[::step], columns=columns)
