"""Figure 3: what the learner knows of a problem in two dimensions after each of four episodes.

A problem is handed in: this knows no function. What is shown comes from the learner's snapshot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from shearline.learner import create
from shearline.protocol.errors import ConfigError
from shearline.studies.benchmark import Problem

Array = npt.NDArray[np.float64]

#: The paper's section 3.4.
EPISODES = 4
EPISODE_LENGTH = 20
#: Points of the decision region along each side of the square.
GRID = 201
#: Parts of the accepted region below this share of the square are specks, not regions.
SPECK = 0.002


@dataclass(frozen=True, slots=True)
class Panel:
    """The state after one episode's update, in unit coordinates.

    Attributes:
        episode: Counted from 0.
        u: All samples so far ``(m, 2)``.
        fresh: Whether a sample is of this episode ``(m,)``.
        good: Whether it is labelled successful ``(m,)``.
        decision: The filter's value on the grid ``(GRID, GRID)``, rows along the second
            parameter; at least 0 means accepted. All 0 while there is no filter.
        means: Of the proposal's components ``(k, 2)``; none while it is uniform.
        covariances: Theirs ``(k, 2, 2)``.
        best_cost: Least cost so far.
    """

    episode: int
    u: Array
    fresh: npt.NDArray[np.bool_]
    good: npt.NDArray[np.bool_]
    decision: Array
    means: Array
    covariances: Array
    best_cost: float

    @property
    def accepted(self) -> float:
        """Share of the square that the filter accepts, 0 to 1."""
        return float(np.mean(self.decision >= 0.0))

    @property
    def regions(self) -> int:
        """Number of connected parts of the accepted region, specks left out."""
        from scipy.ndimage import label  # noqa: PLC0415 - heavy, at the first picture

        parts, count = label(self.decision >= 0.0)
        sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:]
        return int(np.sum(sizes >= SPECK * self.decision.size))

    def holds(self, point: Sequence[float]) -> bool:
        """Tell whether the filter accepts the grid's point nearest to ``(2,)``."""
        x, y = (round(value * (GRID - 1)) for value in point)
        return bool(self.decision[y, x] >= 0.0)


def watch(problem: Problem, seed: int, learner: str, switches: Mapping[str, object]) -> list[Panel]:
    """Return a panel for each episode of one run.

    Args:
        problem: In two dimensions, on the unit square, where every trial succeeds.
        seed: The learner's.
        learner: One whose snapshot shows labels, mixture and a machine: ``psp``, ``psp-paper``.
        switches: What to change about it.

    Raises:
        ConfigError: If the learner's snapshot shows no such thing.
    """
    one = create(learner, problem.space, EPISODE_LENGTH, seed, **switches)
    rng = np.random.default_rng(seed)
    panels = []
    proposals = one.ask(EPISODE_LENGTH)
    for episode in range(EPISODES):
        for proposal in proposals:
            cost, success = problem.trial(proposal.theta, rng)
            one.tell(proposal.trial, cost=cost, success=success)
        proposals = one.ask(EPISODE_LENGTH)  # the update is made when the next episode begins
        panels.append(_panel(one.snapshot(), episode))
    return panels


def grid() -> Array:
    """Return the points at which the decision is taken ``(GRID * GRID, 2)``."""
    axis = np.linspace(0.0, 1.0, GRID)
    return np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)


def _panel(snapshot: Mapping[str, Any], episode: int) -> Panel:
    if "samples" not in snapshot:
        raise ConfigError(
            f"{snapshot['learner']} has no labels to draw: figure 3 takes psp or psp-paper"
        )
    samples, mixture = snapshot["samples"], snapshot["mixture"] or {}
    return Panel(
        episode=episode,
        u=np.array(samples["u"]),
        fresh=np.array(samples["trial"]) >= episode * EPISODE_LENGTH,
        good=np.array(samples["good"], dtype=np.bool_),
        decision=_decision(snapshot["partition"]),
        means=np.array(mixture.get("means", [])).reshape(-1, 2),
        covariances=np.array(mixture.get("covariances", [])).reshape(-1, 2, 2),
        best_cost=float(np.min(samples["cost"])),
    )


def _decision(partition: Mapping[str, Any] | None) -> Array:
    """Evaluate the machine of a snapshot, ``sum_i dual_i exp(-gamma |u - support_i|^2) + b``."""
    if partition is None:
        return np.zeros((GRID, GRID))
    if partition["kind"] != "svm-rbf":
        raise ConfigError(f"figure 3 draws a support vector machine, got {partition['kind']!r}")
    support = np.array(partition["support"])
    squares = np.sum(np.square(grid()[:, None, :] - support[None, :, :]), axis=-1)
    values = np.exp(-partition["gamma"] * squares) @ np.array(partition["dual"])
    result: Array = (values + partition["intercept"]).reshape(GRID, GRID)
    return result
