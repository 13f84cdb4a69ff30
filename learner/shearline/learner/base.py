"""The learner's contract: ask for proposals, tell outcomes by trial number.

A learner is a plain object in one process. It knows a space, a seed and what it was told; it
does not know evaluators, files, clocks or how a trial is run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from shearline.learner.region import Region
from shearline.protocol.space import Space

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Proposal:
    """One tuple to try.

    Attributes:
        trial: Number of the trial, counted from 0 over the whole run.
        theta: The tuple ``(n,)`` in task units.
    """

    trial: int
    theta: Array


@dataclass(frozen=True, slots=True)
class Recommendation:
    """What the learner would use from now on.

    Attributes:
        theta: The tuple ``(n,)`` in task units.
        success_probability: Estimated chance that a fresh trial of ``theta`` succeeds, 0 to 1.
        interval: ``(low, high)`` that holds the true chance in nine runs out of ten or more.
        cost: Expected cost of a successful trial of ``theta``, in the task's cost unit;
            ``nan`` while nothing has succeeded.
        region: The solution subspace around ``theta``, and what a draw from it is worth; ``None``
            until one can be stated.
    """

    theta: Array
    success_probability: float
    interval: tuple[float, float]
    cost: float
    region: Region | None = None


@runtime_checkable
class Learner(Protocol):
    """Ask/tell optimiser over a space; lower cost is better, failures count as failures.

    Trials are numbered 0, 1, ... in the order they are asked for. Proposals depend on the seed
    and on what had been told when an episode began, never on the order of ``tell`` within one.
    """

    space: Space
    episode_length: int

    def ask(self, n: int) -> list[Proposal]:
        """Return ``n`` new proposals with consecutive trial numbers.

        The model behind them is refreshed each time a whole episode has been asked for, from
        everything told until then.

        Raises:
            LearnerError: If ``n`` is not a positive integer.
        """
        ...

    def tell(self, trial: int, *, cost: float, success: bool) -> None:
        """Report one outcome, in any order, late, or never.

        Raises:
            LearnerError: If the trial was never asked for, was told before with another outcome,
                or its cost is not finite. Telling the same outcome twice is ignored.
        """
        ...

    def recommend(self) -> Recommendation:
        """Return a robust tuple: never merely the cheapest ever seen.

        Raises:
            LearnerError: If nothing has been asked for yet.
        """
        ...

    def snapshot(self) -> Mapping[str, object]:
        """Return the model as plain values (numbers, strings, lists), enough to draw it."""
        ...
