"""What each of a learner's switches is worth: the default with one thing changed at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType

from shearline.studies.benchmark import Problem, Row, measure

#: Label to ``(learner, switches)``, in the order of a table in docs/learners.md.
Variants = Mapping[str, tuple[str, Mapping[str, object]]]

#: What psp makes of the paper.
PSP: Variants = MappingProxyType(
    {
        "psp": ("psp", {}),
        "neighbours=0": ("psp", {"neighbours": 0}),
        "labels=previous": ("psp", {"labels": "previous"}),
        "mixture_data=successes": ("psp", {"mixture_data": "successes"}),
        "covariance=full": ("psp", {"covariance": "full"}),
        "svm_c=1e4": ("psp", {"svm_c": 1e4}),
        "gammas=.1 to 10": ("psp", {"gammas": (0.1, 0.32, 1.0, 3.2, 10.0)}),
        "reward=reciprocal": ("psp", {"reward": "reciprocal"}),
        "exhausted=best": ("psp", {"exhausted": "best"}),
        "outside=clip": ("psp", {"outside": "clip"}),
        "spread=0.9": ("psp", {"spread": 0.9}),
        "psp-paper": ("psp-paper", {}),
    }
)


#: What can stand in the filter's port, in both readings of the paper.
PARTITIONERS: Variants = MappingProxyType(
    {
        f"{learner}, {kind}": (learner, {"partition": kind})
        for learner in ("psp", "psp-paper")
        for kind in ("svm", "forest", "boosting", "network")
    }
)

#: What the rivals make of the paper's appendix, and of the ``cma`` package.
RIVALS: Variants = MappingProxyType(
    {
        "hireps": ("hireps", {}),
        "hireps, options=1": ("hireps", {"options": 1}),
        "hireps, options=4": ("hireps", {"options": 4}),
        "hireps, information_loss=.5": ("hireps", {"information_loss": 0.5}),
        "hireps, information_loss=2": ("hireps", {"information_loss": 2.0}),
        "hireps, entropy=.5": ("hireps", {"entropy": 0.5}),
        "hireps, history=0": ("hireps", {"history": 0}),
        "hireps, shrinkage=.9": ("hireps", {"shrinkage": 0.9}),
        "hireps, memory=0": ("hireps", {"memory": 0.0}),
        "hireps, start=centre": ("hireps", {"start": "centre"}),
        "ga": ("ga", {}),
        "ga, crossover=parameter": ("ga", {"crossover": "parameter"}),
        "ga, selection=truncation": ("ga", {"selection": "truncation"}),
        "ga, selection=roulette": ("ga", {"selection": "roulette"}),
        "ga, survivors=0": ("ga", {"survivors": 0}),
        "ga, survivors=40": ("ga", {"survivors": 40}),
        "ga, mutation_variance=.0005": ("ga", {"mutation_variance": 0.0005}),
        "pso": ("pso", {}),
        "pso, draws=particle": ("pso", {"draws": "particle"}),
        "pso, inertia=.7": ("pso", {"inertia": 0.7}),
        "pso, speed=.5": ("pso", {"speed": 0.5}),
        "pso, walls=stop": ("pso", {"walls": "stop"}),
        "pso, walls=reflect": ("pso", {"walls": "reflect"}),
        "cmaes": ("cmaes", {}),
        "cmaes, population=episode": ("cmaes", {"population": "episode"}),
        "cmaes, spread=.3": ("cmaes", {"spread": 0.3}),
        "cmaes, start=.1": ("cmaes", {"start": 0.1}),
        "cmaes, boundary=penalty": ("cmaes", {"boundary": "penalty"}),
    }
)

#: Every table by its name.
TABLES: Mapping[str, Variants] = MappingProxyType(
    {"psp": PSP, "partitioners": PARTITIONERS, "rivals": RIVALS}
)


def switches(
    problem: Callable[[int], Problem],
    variants: Variants = PSP,
    *,
    seeds: Sequence[int] = range(20),
    episodes: int = 10,
    episode_length: int = 40,
) -> Iterator[Row]:
    """Yield a row for each variant on one kind of problem, as it is done.

    Args:
        problem: Makes the problem of a seed.
        variants: What to compare.
        seeds: One run each.
        episodes: Episodes of a run.
        episode_length: Trials of an episode.
    """
    for label, (name, changed) in variants.items():
        yield measure(label, name, changed, problem, seeds, episodes, episode_length)
