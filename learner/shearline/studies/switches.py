"""What each of PSP's switches is worth: the default with one thing changed at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from shearline.studies.benchmark import Problem, Row, measure

#: Label to ``(learner, switches)``, in the order of the table in docs/learners.md.
VARIANTS: Mapping[str, tuple[str, Mapping[str, object]]] = MappingProxyType(
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


def switches(
    problem: Callable[[int], Problem],
    *,
    seeds: Sequence[int] = range(20),
    episodes: int = 10,
    episode_length: int = 40,
) -> list[Row]:
    """Return a row for each of :data:`VARIANTS` on one kind of problem.

    Args:
        problem: Makes the problem of a seed.
        seeds: One run each.
        episodes: Episodes of a run.
        episode_length: Trials of an episode.
    """
    return [
        measure(label, name, changed, problem, seeds, episodes, episode_length)
        for label, (name, changed) in VARIANTS.items()
    ]
