"""Proves that a recorded trial comes out again to the last bit, or says what differs.

A trial is identical if the digest of its full trace (double precision), every recorded trace
(single precision) and the outcome are the same bits. Another engine, model or task does not make
it different, it explains why it is.
"""

from __future__ import annotations

from dataclasses import dataclass

from shearline.evaluator.base import Task
from shearline.evaluator.replay.again import Replayed, again
from shearline.evaluator.replay.case import Case
from shearline.evaluator.replay.compare import compare
from shearline.protocol.errors import ConfigError
from shearline.protocol.messages import JUDGED, Counted
from shearline.protocol.task import TaskSpec, digest


@dataclass(frozen=True, slots=True)
class Verification:
    """Whether one trial came out again.

    Attributes:
        trial: Its number.
        identical: To the last bit.
        digest_recorded: Of the trace, or of the outcome where the task has no trace.
        digest_replayed: Of the same when run again; ``""`` if it had no verdict.
        why: What differs and what may be the reason, in one sentence. If identical ``""``, or that
            it is so on another engine or task than the recorded one.
    """

    trial: int
    identical: bool
    digest_recorded: str
    digest_replayed: str
    why: str = ""


def verify(task: Task, case: Case) -> Verification:
    """Run a trial again and hold it against the record.

    Raises:
        ConfigError: If the trial has no outcome to hold it against, or the task here has other
            parameters than the recorded one.
    """
    check_ended(case)
    return judge(again(task, case), task.spec)


def check_ended(case: Case) -> None:
    """Raise if there is nothing that a trial could be held against.

    Raises:
        ConfigError: If it has no outcome on record.
    """
    if not case.ended:
        raise ConfigError(
            f"trial {case.trial} was lost or never ended, so it has no outcome on record: there is"
            " nothing to verify, but it can be replayed without --verify"
        )


def judge(replayed: Replayed, spec: TaskSpec) -> Verification:
    """Hold a trial that was run again, unchanged, against its record.

    Args:
        replayed: The trial; must have a recorded outcome.
        spec: The task that ran it.
    """
    case = replayed.case
    assert case.outcome is not None
    differs = case.contradiction() or _difference(replayed, case.outcome)
    other = _other(replayed, case.outcome, spec)
    reason = other or _same_but_different(replayed)
    return Verification(
        trial=case.trial,
        identical=not differs,
        digest_recorded=case.digest,
        digest_replayed=replayed.digest,
        why=f"{differs}; {reason}" if differs else other,
    )


def _difference(replayed: Replayed, recorded: Counted) -> str:
    """Return what came out differently, or ``""``."""
    verdict = replayed.verdict
    if verdict.kind not in JUDGED:
        return f"it was {recorded.kind} and is {verdict.kind} here ({verdict.why})"
    traces = _traces(replayed)
    if recorded.digest and replayed.digest != recorded.digest:
        return traces or (
            "the digest of the trace differs, though no sample on record does: by less than single"
            " precision shows, or the digest itself was changed"
            if replayed.case.traces
            else "the digest of the trace differs, and no trace is on record to say where"
        )
    if traces:
        return f"the recorded trace is not the one the trial had: {traces}"
    return _outcomes(replayed, recorded)


def _traces(replayed: Replayed) -> str:
    """Return where a recorded trace differs from the one run again, or ``""``."""
    mine, recorded = replayed.verdict.trace, replayed.case.traces
    if mine is None:
        return "a trace is on record, the task here has none" if recorded else ""
    for n, trace in enumerate(recorded):
        found = compare(trace, mine)
        if found:
            return f"{found} in attempt {n + 1} of {len(recorded)}" if len(recorded) > 1 else found
    return ""


def _outcomes(replayed: Replayed, recorded: Counted) -> str:
    """Return which number of the outcome differs, or ``""``."""
    v = replayed.verdict
    was, here = f"{recorded.kind} {recorded.why}".rstrip(), f"{v.kind} {v.why}".rstrip()
    if was != here:
        return f"the outcome on record is {was}, here it is {here}"
    if recorded.cost.hex() != v.cost.hex():
        return f"the cost is {recorded.cost!r} on record, {v.cost!r} here"
    for name in [*recorded.extras, *v.extras]:
        number, replayed_number = recorded.extras.get(name), v.extras.get(name)
        if number is None or replayed_number is None or number.hex() != replayed_number.hex():
            return f"{name} is {number!r} on record, {replayed_number!r} here"
    return ""


def _other(replayed: Replayed, recorded: Counted, spec: TaskSpec) -> str:
    """Say in what the task or the engine here is another than the recorded one, or ``""``."""
    if digest(spec) != digest(replayed.case.task):
        return f"the task is not the same: {_other_task(replayed.case.task, spec)}"
    if recorded.engine != replayed.engine:
        return f"the engine is not the same: {recorded.engine} on record, {replayed.engine} here"
    return ""


def _same_but_different(replayed: Replayed) -> str:
    """Say what may be behind a difference where task and engine are the same."""
    if replayed.case.contradiction() or replayed.case.digest == replayed.digest:
        return "the record was changed after the run"
    return (
        f"the engine is the same ({replayed.engine}), so the record was changed, or this processor"
        " or its libraries compute differently"
    )


def _other_task(recorded: TaskSpec, spec: TaskSpec) -> str:
    """Name the first thing in which two tasks with the same parameters differ."""
    for name, (unit, low, high) in recorded.space.items():
        _, here_low, here_high = spec.space[name]
        if (low, high) != (here_low, here_high):
            return (
                f"{name} went from {low:g} to {high:g} {unit},"
                f" here it goes from {here_low:g} to {here_high:g} {unit}"
            )
    was = {"name": recorded.name, "trial_s": recorded.trial_s, **recorded.options}
    here = {"name": spec.name, "trial_s": spec.trial_s, **spec.options}
    for name in [*was, *here]:
        if was.get(name) != here.get(name):
            return f"its {name} was {was.get(name)!r}, here it is {here.get(name)!r}"
    return "its digest differs"
