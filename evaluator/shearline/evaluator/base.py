"""What an evaluator runs: a task takes one tuple and a seed and returns one outcome.

This is the seam between the worker, which speaks the protocol, and anything that can run a
trial: the key-in-lock skill on a plant, a real arm, or the user's own callable. A task knows
nothing of leases, attempts or learners; it calls ``beat`` from its own loop so that whoever
hands it out can tell work from a hang.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from shearline.protocol.errors import ShearlineError
from shearline.protocol.messages import Result, Trial
from shearline.protocol.pose import Placed
from shearline.protocol.task import TaskSpec

Array = npt.NDArray[np.float64]


class TrialAborted(ShearlineError):  # noqa: N818 - an abort is an outcome, not a mistake
    """The trial ended without a verdict (engine, robot or operator); it never becomes a cost."""


class TrialRejected(TrialAborted):
    """What runs the trial does not allow this tuple, and has not begun with it."""


@dataclass(frozen=True, slots=True)
class Trace:
    """What happened during one trial, in columns that share one clock.

    Attributes:
        t_s: Trial clock ``(samples,)`` [s], from 0.
        columns: Name to ``(unit, values (samples,) float32)``; a name with a dot groups, e.g.
            ``"tip.x": ("m", ...)``.
        events: ``(t_s, name)`` of phase changes and verdicts, in order.
        placed: Bodies of the scene whose place is this trial's own.
    """

    t_s: npt.NDArray[np.float32]
    columns: Mapping[str, tuple[str, npt.NDArray[np.float32]]]
    events: tuple[tuple[float, str], ...] = ()
    placed: tuple[Placed, ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """Verdict of one trial.

    Attributes:
        cost: Finite; lower is better.
        success: Whether the task's goal was reached.
        digest: Hexadecimal digest of the full trace, or ``""`` for tasks without one.
        extras: Further numbers worth keeping, e.g. ``{"depth_m": .025}``.
        why: Name of the failure (``"torque"``, ``"roi"``, ``"time"``), ``""`` on success.
        trace: What happened, or ``None``.
    """

    cost: float
    success: bool
    digest: str = ""
    extras: Mapping[str, float] = field(default_factory=dict)
    why: str = ""
    trace: Trace | None = None


class Task(Protocol):
    """One thing to learn, ready to be tried again and again in this process."""

    @property
    def spec(self) -> TaskSpec:
        """Name, space and options; its digest must agree with the learner's."""
        ...

    @property
    def engine(self) -> str:
        """Fingerprint of what runs the trial, e.g. ``"mujoco 4.0.0 model 3f2a..."``."""
        ...

    def warm(self) -> None:
        """Load, compile and touch everything, so that the first trial costs what the others do."""
        ...

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
        """Run one trial.

        Args:
            theta: The tuple ``(n,)`` in task units, already checked against the bounds.
            seed: 0 to 2**63 - 1; the same tuple and seed give the same outcome on the same engine.
            beat: To be called from the trial's own loop, at least every 0.2 s of wall time. It may
                raise to stop the trial; let that exception through.

        Raises:
            TrialAborted: If no verdict was reached.
        """
        ...


class Outstanding(Protocol):
    """Results that a run has not acknowledged, kept by whoever measured them."""

    def pending(self, run: str) -> list[Result]:
        """Return what a run has not acknowledged, oldest first."""
        ...

    def drop(self, token: str) -> None:
        """Forget a result: the learner has it, or never wants it."""
        ...


@runtime_checkable
class Attended(Protocol):
    """A task on hardware: a person decides when trials may come, and results are too dear to lose.

    Beside this it is a :class:`Task`; tasks that are not attended need none of it.
    """

    @property
    def kind(self) -> str:
        """What the evaluator calls itself, ``"robot"``."""
        ...

    @property
    def spool(self) -> Outstanding:
        """Results of this hardware that may still be owed, also of earlier processes."""
        ...

    @property
    def farewell_s(self) -> float:
        """How long a trial may take to end in order once ``beat`` has raised [s]."""
        ...

    def join(
        self,
        name: str,
        ready: Callable[[bool], None],
        over: Callable[[int, str], None],
        look: Callable[[], tuple[bool, bool]],
    ) -> None:
        """Be given a worker, before anything else.

        Args:
            name: The evaluator's; results are owed under it.
            ready: To be called, from any thread, when trials may come or may not any more.
            over: To be called, from any thread, with an exit code and a sentence when nothing
                more will come of this hardware in this process.
            look: Tells whether the learner can be reached, and whether the run is held.

        Raises:
            ConfigError: If results are owed under another name.
        """
        ...

    def announce(self, run: str, trial: Trial) -> None:
        """Be told which attempt of which run the next ``run`` is for."""
        ...

    def close(self) -> None:
        """Let go of the hardware in good order, and wait until it is let go of."""
        ...
