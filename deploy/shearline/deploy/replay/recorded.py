"""From a run folder to trials that can be run again, or one sentence why they cannot.

Only a task that a person here names is imported: a record may come from anywhere, so of itself it
gets no further than the built-in tasks.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import msgspec

from shearline.evaluator import base
from shearline.evaluator.plants import DEFAULT
from shearline.evaluator.replay import Case
from shearline.evaluator.tasks import load_task
from shearline.protocol.codec import decode
from shearline.protocol.errors import ConfigError, ProtocolError, RecordError
from shearline.protocol.messages import Counted, Result, Wire
from shearline.protocol.task import TaskSpec
from shearline.record.reader import Run

#: What an evaluator says it is when its trials happen in the world.
ROBOT = "robot"


class Recorded:
    """The trials of a recorded run, as cases.

    Args:
        run: What was read of it.
    """

    def __init__(self, run: Run) -> None:
        self.run = run

    @cached_property
    def spec(self) -> TaskSpec:
        """What the run learned.

        Raises:
            RecordError: If the record does not say.
        """
        try:
            return msgspec.convert(self.run.settings()["task"], TaskSpec)
        except (KeyError, msgspec.ValidationError):
            damage = f" ({self.run.damage[0]})" if self.run.damage else ""
            raise RecordError(
                f"the record in {self.run.run_dir} does not say what was learned{damage}:"
                " expected a task in its configuration"
            ) from None

    @cached_property
    def robots(self) -> frozenset[str]:
        """Names of the evaluators that were robots."""
        return frozenset(state.evaluator for state in self.run.evaluators if state.kind == ROBOT)

    def task_name(self, named: str | None) -> str:
        """Return what :func:`load` is to be given.

        Args:
            named: ``FILE:FUNCTION`` as a person typed it, or ``None``.

        Raises:
            ConfigError: If the run learned code of somebody's own and nobody here named it.
            RecordError: If the record does not say what was learned.
        """
        if named is None and ":" in self.spec.name:
            raise ConfigError(
                f"this run learned {self.spec.name}, code of your own: name it with"
                " --task FILE:FUNCTION"
            )
        return named or self.spec.name

    def case(self, trial: int) -> Case:
        """Return what is on record about one trial.

        Raises:
            ConfigError: If there is no such trial, or a robot ran it.
            RecordError: If the record does not say what was learned.
        """
        outcome = next((known for known in self.run.outcomes if known.trial == trial), None)
        if outcome is None and trial not in self.run.proposed:
            raise ConfigError(_nowhere(self.run, trial))
        if outcome is not None and outcome.evaluator in self.robots:
            raise ConfigError(
                f"trial {trial} ran on the robot {outcome.evaluator}, which cannot be run again"
                " from a record: look at what it did with shearline view"
            )
        return self._case(trial, outcome)

    def cases(self) -> Iterator[Case]:
        """Yield every trial that can be verified, in order of number."""
        left_out = {trial for trial, _ in self.unverifiable()}
        for outcome in self.run.outcomes:
            if outcome.trial not in left_out:
                yield self._case(outcome.trial, outcome)

    def unverifiable(self) -> Iterator[tuple[int, str]]:
        """Yield ``(trial, why)`` for every trial that nothing can be held against."""
        for outcome in self.run.outcomes:
            if outcome.kind is None:
                yield outcome.trial, "lost"
            elif outcome.evaluator in self.robots:
                yield outcome.trial, "run by a robot"
        ended = {outcome.trial for outcome in self.run.outcomes}
        for trial in self.run.proposed:
            if trial not in ended:
                yield trial, "never ended"

    def _case(self, trial: int, outcome: Counted | None) -> Case:
        proposed = self.run.proposed.get(trial)
        given = proposed if outcome is None else outcome
        assert given is not None
        return Case(
            trial=trial,
            task=self.spec,
            theta=tuple(given.theta),
            seed=given.seed,
            proposed=proposed,
            outcome=outcome,
            traces=self._traces(trial, outcome),
        )

    def _traces(self, trial: int, outcome: Counted | None) -> tuple[base.Trace, ...]:
        """Return the traces of a trial, without those of attempts on another engine.

        In a run on several engines a trial may have been tried on more than one of them; only
        the one that was counted has something to prove.
        """
        traces = self.run.traces(trial)
        if len(traces) > 1 and outcome is not None:
            ours = (outcome.engine, None)
            traces = [trace for trace in traces if self._engines.get(trace.token) in ours]
        return tuple(
            base.Trace(trace.t_s, trace.columns, trace.events, trace.placed) for trace in traces
        )

    @cached_property
    def _engines(self) -> dict[str, str]:
        """Engine of each attempt, by token, as its own result said it."""
        engines = {}
        for _, message in self.run.messages("/wire"):
            assert isinstance(message, Wire)
            if message.sent:
                continue
            try:
                result = decode(message.payload, Result)
            except ProtocolError:
                continue
            engines[result.token] = result.engine
        return engines


def load(name: str, plant: str = DEFAULT) -> base.Task:
    """Return a task, with what it needs loaded.

    Args:
        name: What :meth:`Recorded.task_name` returns.
        plant: What it acts on, if it has a plant.

    Raises:
        ConfigError: If there is none of that name, or what it needs is not installed.
    """
    task = load_task(name, plant)
    try:
        _ = task.engine
    except ModuleNotFoundError as missing:
        raise ConfigError(
            f"task {name} needs {missing.name}, which is not installed here:"
            " pip install 'shearline[all]' brings all that is needed"
        ) from None
    return task


def _nowhere(run: Run, trial: int) -> str:
    known = sorted({outcome.trial for outcome in run.outcomes} | set(run.proposed))
    damage = f"; {run.damage[0]}" if run.damage else ""
    if not known:
        return f"no trial {trial} in {run.run_dir}: nothing is on record there{damage}"
    span = f"{len(known)} trials, {known[0]} to {known[-1]}"
    return f"no trial {trial} in {run.run_dir}: it has {span}{damage}"
