"""A warm start: what another run tried, for a learner that starts from it."""

from __future__ import annotations

from pathlib import Path

from shearline.learner.prior import Prior
from shearline.learner.registry import PRIMED, resolve
from shearline.protocol.errors import ConfigError
from shearline.protocol.messages import OutcomeKind, Purpose
from shearline.protocol.task import TaskSpec


def prior_of(run_dir: Path, task: TaskSpec, learner: str) -> Prior:
    """Return the trials that a run learned from, as what another may start from.

    Trials of a confirmation are left out, as its own learner was not told of them either.

    Args:
        run_dir: The other run's folder, with a record or a journal; the run may still go on.
        task: What is to be learned; any task on the same parameters.
        learner: Who is to learn it.

    Raises:
        ConfigError: If that run has other parameters, nothing to start from, or the learner
            cannot start from anything.
        RecordError: If the run cannot be read.
    """
    from shearline.deploy.opened import opened  # noqa: PLC0415 - loads the formats of records
    from shearline.deploy.replay.recorded import Recorded  # noqa: PLC0415 - as above

    if resolve(learner) not in PRIMED:
        raise ConfigError(
            f"{learner} cannot start from another run: choose one of {', '.join(sorted(PRIMED))}"
        )
    run = opened(run_dir)
    other = Recorded(run).spec
    if list(other.space.items()) != list(task.space.items()):
        raise ConfigError(
            f"{run_dir} learned {other.name} with {_differing(other, task)}: a run starts from"
            " another with the same parameters, units and bounds only"
        )
    told = [
        outcome
        for outcome in run.outcomes
        if outcome.purpose is Purpose.LEARNING and outcome.kind is not None
    ]
    if not told:
        raise ConfigError(f"{run_dir} has no outcome to start from yet: choose another run")
    return Prior(
        run=run_dir.resolve().name,
        task=other.name,
        theta=[list(outcome.theta) for outcome in told],
        cost=[outcome.cost for outcome in told],
        success=[outcome.kind is OutcomeKind.SUCCESS for outcome in told],
    )


def _differing(other: TaskSpec, task: TaskSpec) -> str:
    """Say what sets two spaces apart, by the first parameter that does."""
    for name, (unit, low, high) in other.space.items():
        if task.space.get(name) != (unit, low, high):
            return f"{name} in [{low:g}, {high:g}] {unit}".rstrip()
    if len(other.space) != len(task.space):
        return f"{len(other.space)} parameters, not {len(task.space)}"
    return "its parameters in another order"
