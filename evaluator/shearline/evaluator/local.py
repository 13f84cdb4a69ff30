"""One trial in this process: bounds first, then the task, and every way it can end as a value.

The worker runs its attempts through this door, and so can anything that tries tuples without a
network. It knows no learner, no lease and no clock but the wall time a trial took.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from operator import le

import msgspec
import numpy as np
import numpy.typing as npt

from shearline.evaluator.base import Outcome, Task, Trace, TrialAborted, TrialRejected
from shearline.protocol.messages import OutcomeKind, TraceData, clip
from shearline.protocol.space import Space

#: What one result carries.
EXTRAS_MAX = 64

#: What one trace carries.
EVENTS_MAX = 256


class Verdict(msgspec.Struct, frozen=True):
    """How one trial ended, whatever happened in it.

    Attributes:
        kind: Success and failure have a cost; aborted and rejected have none.
        cost: Finite; 0 unless success or failure.
        why: Failure name, or what went wrong.
        digest: Of the full trace, or ``""``.
        extras: At most 64 finite numbers.
        wall_s: How long it ran [s].
        trace: What happened, or ``None``. It may share memory with the next trial.
    """

    kind: OutcomeKind
    cost: float = 0.0
    why: str = ""
    digest: str = ""
    extras: Mapping[str, float] = {}
    wall_s: float = 0.0
    trace: Trace | None = None


def run_trial(
    task: Task,
    theta: npt.ArrayLike,
    seed: int,
    beat: Callable[[], None] = lambda: None,
    space: Space | None = None,
) -> Verdict:
    """Run one trial and return how it ended; no mistake of a task or of a sender escapes.

    Args:
        task: What to run, warm or not.
        theta: The tuple ``(n,)`` in task units, checked against the task's bounds here.
        seed: 0 to 2**63 - 1.
        beat: Handed to the task; what it raises ends the trial as aborted.
        space: The task's, if it is at hand: to make one takes longer than a short trial.
    """
    values = np.asarray(theta, dtype=np.float64)
    why = objection(Space(task.spec.space) if space is None else space, values)
    if why:
        return Verdict(OutcomeKind.REJECTED, why=why)
    start_s = time.perf_counter()
    try:
        outcome = task.run(values, seed, beat)
    except TrialRejected as rejected:
        return Verdict(OutcomeKind.REJECTED, why=clip(str(rejected)))
    except TrialAborted as aborted:
        return _aborted(str(aborted) or "aborted without a reason", start_s)
    except (Exception, SystemExit) as fault:  # noqa: BLE001 - an evaluator outlives its tasks
        return _aborted(f"{type(fault).__name__}: {fault}", start_s)
    if not math.isfinite(outcome.cost):
        return _aborted(f"expected a finite cost, got {outcome.cost}", start_s)
    return Verdict(
        kind=OutcomeKind.SUCCESS if outcome.success else OutcomeKind.FAILURE,
        cost=float(outcome.cost),
        why=clip(outcome.why),
        digest=clip(outcome.digest, 128),
        extras=_extras(outcome),
        wall_s=time.perf_counter() - start_s,
        trace=outcome.trace,
    )


def objection(space: Space, theta: npt.ArrayLike) -> str:
    """Return why a tuple ``(n,)`` may not be tried here, or ``""``."""
    values = np.asarray(theta, dtype=np.float64)
    if values.shape != (len(space),):
        return f"expected {len(space)} parameters, got shape {values.shape}"
    plain = values.tolist()
    if all(map(le, space.lows, plain)) and all(map(le, plain, space.highs)):
        return ""
    for p, value in zip(space, plain, strict=True):
        if not p.low <= value <= p.high:
            return f"{p.name} = {value:g} {p.unit} is outside [{p.low:g}, {p.high:g}]"
    raise AssertionError(plain)


def trace_data(trace: Trace, trial: int, token: str) -> TraceData:
    """Copy a trace into the message that observers read: float32 columns, one after the other."""
    columns = {"t_s": ("s", trace.t_s), **trace.columns}
    data = np.stack([np.asarray(values, dtype="<f4") for _, values in columns.values()])
    return TraceData(
        trial=trial,
        token=token,
        samples=data.shape[1],
        names=[clip(name) for name in columns],
        units=[clip(unit) for unit, _ in columns.values()],
        data=data.tobytes(),
        events=[(float(t_s), clip(name)) for t_s, name in trace.events[:EVENTS_MAX]],
        placed=list(trace.placed),
    )


def _aborted(why: str, start_s: float) -> Verdict:
    return Verdict(OutcomeKind.ABORTED, why=clip(why), wall_s=time.perf_counter() - start_s)


def _extras(outcome: Outcome) -> dict[str, float]:
    """Keep what a result can carry: a number that is not finite says nothing worth a trial."""
    if not outcome.extras:
        return {}
    finite = {clip(k): float(v) for k, v in outcome.extras.items() if math.isfinite(v)}
    return dict(list(finite.items())[:EXTRAS_MAX])
