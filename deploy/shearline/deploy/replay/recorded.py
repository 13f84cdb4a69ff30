"""From a run folder to trials that can be run again, or one sentence why they cannot.

Only a task that a person here names is imported: a record may come from anywhere, so of itself it
gets no further than the built-in tasks.
"""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from shearline.evaluator import base
from shearline.evaluator.replay import Case
from shearline.evaluator.tasks import load_task
from shearline.protocol.errors import ConfigError, RecordError
from shearline.protocol.messages import Counted, TaskSpec
from shearline.record.reader import Run, Trace

#: What an evaluator says it is when its trials happen in the world.
ROBOT = "robot"


def spec_of(run: Run) -> TaskSpec:
    """Return what a run learned.

    Raises:
        RecordError: If the record does not say.
    """
    try:
        return msgspec.convert(run.settings()["task"], TaskSpec)
    except (KeyError, msgspec.ValidationError):
        damage = f" ({run.damage[0]})" if run.damage else ""
        raise RecordError(
            f"the record in {run.run_dir} does not say what was learned{damage}:"
            " expected a task in its configuration"
        ) from None


def task_name(run: Run, named: str | None) -> str:
    """Return what :func:`load` is to be given for a run.

    Args:
        run: The run.
        named: ``FILE:FUNCTION`` as a person typed it, or ``None``.

    Raises:
        ConfigError: If the run learned code of somebody's own and nobody here named it.
    """
    recorded = spec_of(run).name
    if named is None and ":" in recorded:
        raise ConfigError(
            f"this run learned {recorded}, code of your own: name it with --task FILE:FUNCTION"
        )
    return named or recorded


def load(name: str) -> base.Task:
    """Return a task, with what it needs loaded.

    Raises:
        ConfigError: If there is none of that name, or what it needs is not installed.
    """
    task = load_task(name)
    try:
        _ = task.engine
    except ModuleNotFoundError as missing:
        raise ConfigError(
            f"task {name} needs {missing.name}, which is not installed here:"
            " pip install 'shearline[all]' brings all that is needed"
        ) from None
    return task


def case_of(run: Run, trial: int) -> Case:
    """Return what is on record about one trial.

    Raises:
        ConfigError: If there is no such trial, or a robot ran it.
        RecordError: If the record does not say what was learned.
    """
    outcome = next((known for known in run.outcomes if known.trial == trial), None)
    if outcome is None and trial not in run.proposed:
        raise ConfigError(_nowhere(run, trial))
    if outcome is not None and outcome.evaluator in robots(run):
        raise ConfigError(
            f"trial {trial} ran on the robot {outcome.evaluator}, which cannot be run again from a"
            " record: look at what it did with shearline view"
        )
    return _case(run, spec_of(run), trial, outcome)


def cases_of(run: Run) -> Iterator[Case]:
    """Yield every trial of a run that can be verified, in order of number."""
    spec = spec_of(run)
    left_out = {trial for trial, _ in unverifiable(run)}
    for outcome in run.outcomes:
        if outcome.trial not in left_out:
            yield _case(run, spec, outcome.trial, outcome)


def unverifiable(run: Run) -> Iterator[tuple[int, str]]:
    """Yield ``(trial, why)`` for every trial that cannot be held against another run of it."""
    known = robots(run)
    for outcome in run.outcomes:
        if outcome.kind is None:
            yield outcome.trial, "lost"
        elif outcome.evaluator in known:
            yield outcome.trial, "run by a robot"
    ended = {outcome.trial for outcome in run.outcomes}
    for trial in run.proposed:
        if trial not in ended:
            yield trial, "never ended"


def robots(run: Run) -> set[str]:
    """Return the names of the evaluators that were robots."""
    return {state.evaluator for state in run.evaluators if state.kind == ROBOT}


def _case(run: Run, spec: TaskSpec, trial: int, outcome: Counted | None) -> Case:
    proposed = run.proposed.get(trial)
    given = proposed if outcome is None else outcome
    assert given is not None
    return Case(
        trial=trial,
        task=spec,
        theta=tuple(given.theta),
        seed=given.seed,
        proposed=proposed,
        outcome=outcome,
        traces=tuple(_trace(trace) for trace in run.traces(trial)),
    )


def _trace(trace: Trace) -> base.Trace:
    return base.Trace(t_s=trace.t_s, columns=trace.columns, events=trace.events)


def _nowhere(run: Run, trial: int) -> str:
    known = sorted({outcome.trial for outcome in run.outcomes} | set(run.proposed))
    damage = f"; {run.damage[0]}" if run.damage else ""
    if not known:
        return f"no trial {trial} in {run.run_dir}: nothing is on record there{damage}"
    span = f"{len(known)} trials, {known[0]} to {known[-1]}"
    return f"no trial {trial} in {run.run_dir}: it has {span}{damage}"
