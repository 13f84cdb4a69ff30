"""Learners held to their word on noisy problems whose true chances of success are known."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from shearline.sims import ridges
from shearline.sims.functions import Array, Problem, fragile_ridge, noisy_sphere
from shearline.studies.benchmark import run_learner
from shearline.studies.claims import Claim, Coverage, claim_of, coverage

EPISODES, EPISODE_LENGTH = 10, 20

#: Name to the problem of a seed.
PROBLEMS: Mapping[str, Callable[[int], Problem]] = MappingProxyType(
    {
        "ridge": lambda _: fragile_ridge(),
        **{
            kind: lambda seed, kind=kind: ridges.by_name(kind, seed)  # type: ignore[misc]  # bound now
            for kind in ridges.KINDS
        },
        "sphere-20": lambda seed: noisy_sphere(20, seed),
        "sphere-2": lambda seed: noisy_sphere(2, seed),
    }
)


def coverages(
    learners: Sequence[str], problems: Sequence[str], seeds: Sequence[int]
) -> Iterator[Coverage]:
    """Yield a row for each learner and problem: runs of 10 episodes of 20 trials, one a seed."""
    for learner in learners:
        for name in problems:
            claims = [_claim(learner, PROBLEMS[name](seed), seed) for seed in seeds]
            yield coverage(learner, name, claims)


def _claim(learner: str, problem: Problem, seed: int) -> Claim:
    run = run_learner(learner, problem, episodes=EPISODES, episode_length=EPISODE_LENGTH, seed=seed)
    success = problem.success
    assert success is not None, "nothing ever fails here: there is nothing to claim"

    def chance(theta: Array) -> Array:
        return np.asarray(success(theta))

    return claim_of(run.recommendation, chance, seed)
