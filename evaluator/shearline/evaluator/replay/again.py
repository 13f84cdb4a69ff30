"""Runs a recorded trial again, as it was or with changes.

The trial goes through the same door as an evaluator's, :func:`shearline.evaluator.local.run_trial`,
so what comes out is what an evaluator would have reported.
"""

from __future__ import annotations

import contextlib
import sys
from dataclasses import dataclass

from shearline.evaluator.base import Task
from shearline.evaluator.local import Verdict, run_trial, trace_data
from shearline.evaluator.replay.case import Case, outcome_digest
from shearline.evaluator.replay.change import Change
from shearline.protocol.errors import ConfigError
from shearline.protocol.messages import JUDGED, TraceData, clip
from shearline.protocol.space import Space

#: Stands where an attempt's token would; nobody handed this one out.
TOKEN = "replayed"  # noqa: S105 - says what it is, opens nothing


@dataclass(frozen=True, slots=True)
class Replayed:
    """How a recorded trial ended when it was run again.

    Attributes:
        case: What is on record.
        theta: The tuple ``(n,)`` that was tried, with changes in it if there were any.
        seed: The seed it was tried with.
        verdict: How it ended. Its trace may share memory with the next trial.
        engine: Fingerprint of what ran it.
    """

    case: Case
    theta: tuple[float, ...]
    seed: int
    verdict: Verdict
    engine: str

    @property
    def digest(self) -> str:
        """Digest of the full trace, or of the outcome where the record has none of a trace."""
        v = self.verdict
        if v.kind not in JUDGED:
            return ""
        if v.digest and not self.case.without_trace:
            return v.digest
        return outcome_digest(v.kind, v.cost, v.why, v.extras)

    def trace_data(self) -> TraceData | None:
        """Return a copy of the trace as the message that the record would hold, if there is one."""
        trace = self.verdict.trace
        return None if trace is None else trace_data(trace, self.case.trial, TOKEN)


def again(task: Task, case: Case, change: Change | None = None) -> Replayed:
    """Run a recorded trial again.

    Args:
        task: The run's task, in this process; loaded on first use.
        case: The trial.
        change: What is to be different.

    Raises:
        ConfigError: If the task here has other parameters than the recorded one.
    """
    space = Space(task.spec.space)
    check_same_parameters(case, space)
    theta = change.applied(space, case.theta) if change else case.theta
    seed = change.seed if change and change.seed is not None else case.seed
    # A user's function may print; standard output is for whoever asked for the replay.
    with contextlib.redirect_stdout(sys.stderr):
        verdict = run_trial(task, theta, seed, space=space)
        engine = clip(task.engine)
    return Replayed(case, theta, seed, verdict, engine)


def check_same_parameters(case: Case, space: Space) -> None:
    """Raise if a recorded tuple means nothing to the task here.

    Raises:
        ConfigError: If names, units or their order differ.
    """
    recorded = [(name, unit) for name, (unit, _, _) in case.task.space.items()]
    if recorded != [(p.name, p.unit) for p in space]:
        raise ConfigError(
            f"this run's {case.task.name} has the parameters {', '.join(n for n, _ in recorded)},"
            f" the one here has {', '.join(space.names)}: replay it with the version that made it"
        )
