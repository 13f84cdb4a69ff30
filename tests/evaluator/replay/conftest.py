"""One key-in-lock trial as a record has it, made by running it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from shearline.evaluator.base import Task, Trace
from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.local import run_trial
from shearline.evaluator.replay import Case
from shearline.evaluator.skill.baselines import TUPLES, tuple_of
from shearline.protocol.messages import Counted, OutcomeKind, Proposed

CaseOf = Callable[[Task, list[float], int], Case]


def _case_of(task: Task, theta: list[float], seed: int, trial: int = 7) -> Case:
    verdict = run_trial(task, theta, seed)
    assert verdict.kind is not OutcomeKind.ABORTED
    traces: tuple[Trace, ...] = ()
    if verdict.trace is not None:
        trace = verdict.trace
        columns = {name: (unit, values.copy()) for name, (unit, values) in trace.columns.items()}
        traces = (Trace(trace.t_s.copy(), columns, trace.events),)
    outcome = Counted(
        trial=trial,
        episode=1,
        theta=theta,
        kind=verdict.kind,
        cost=verdict.cost,
        seed=seed,
        evaluator="sim-0",
        attempts=1,
        late=False,
        engine=task.engine,
        digest=verdict.digest,
        wall_s=verdict.wall_s,
        why=verdict.why,
        extras=dict(verdict.extras),
        at_s=1_700_000_000.0,
    )
    proposed = Proposed(trial=trial, episode=1, theta=theta, seed=seed)
    return Case(trial, task.spec, tuple(theta), seed, proposed, outcome, traces)


@pytest.fixture(scope="session")
def case_of() -> CaseOf:
    """Run a trial and return what would be on record about it."""
    return _case_of


@pytest.fixture(scope="session")
def keylock() -> KeylockTask:
    task = KeylockTask()
    task.warm()
    return task


@pytest.fixture(scope="session")
def recorded(keylock: KeylockTask) -> Case:
    """A success of about half a second in the lock."""
    case = _case_of(keylock, np.asarray(tuple_of(TUPLES["centre-push"])).tolist(), 4)
    assert case.outcome is not None
    assert case.outcome.kind is OutcomeKind.SUCCESS
    return case
