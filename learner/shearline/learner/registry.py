"""Learners by name, so that a run, a study or a user can ask for one with a word.

Nothing heavy is imported until a learner is created: a name costs nothing.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping
from types import MappingProxyType
from typing import cast

from shearline.learner.base import Learner
from shearline.learner.errors import SwitchError, UnknownLearnerError
from shearline.protocol.space import Space

#: Name to ``module:callable``; the callable takes ``(space, episode_length, seed, **switches)``.
LEARNERS: Mapping[str, str] = MappingProxyType(
    {
        "psp-ranked": "shearline.learner.ranked.ranked:ranked",
        "psp": "shearline.learner.psp.psp:working",
        "psp-paper": "shearline.learner.psp.psp:literal",
        "hireps": "shearline.learner.hireps:HiREPS",
        "cmaes": "shearline.learner.cmaes:CMAES",
        "ga": "shearline.learner.ga:GeneticAlgorithm",
        "pso": "shearline.learner.pso:ParticleSwarm",
        "random": "shearline.learner.random_search:RandomSearch",
        "lhs": "shearline.learner.lhs:LatinHypercube",
    }
)

#: Learners that need more than the extra ``learner``; studies of all learners leave them out.
EXTRAS: Mapping[str, str] = MappingProxyType({"tpe": "shearline.learner.tpe:TPE"})

#: Those that can start from the trials of another run.
PRIMED = frozenset({"psp-ranked", "psp", "psp-paper", "hireps", "cmaes", "ga", "pso", "tpe"})

#: Not an optimiser, so not listed: it tries the tuples it is given, ``tuples=[...]``.
UNLISTED: Mapping[str, str] = MappingProxyType({"plan": "shearline.learner.plan:Plan"})

#: Other words for them: ``best`` is the learner we would use ourselves.
ALIASES: Mapping[str, str] = MappingProxyType({"best": "psp-ranked"})


def names() -> tuple[str, ...]:
    """Return every name that :func:`create` takes, aliases last."""
    return (*LEARNERS, *EXTRAS, *ALIASES)


def resolve(name: str) -> str:
    """Return the name behind an alias, or the name itself.

    Raises:
        UnknownLearnerError: If there is no such learner.
    """
    resolved = ALIASES.get(name, name)
    if resolved not in {**LEARNERS, **EXTRAS, **UNLISTED}:
        raise UnknownLearnerError(
            f"no learner is called {name!r}: expected one of {', '.join(names())}"
        )
    return resolved


def create(
    name: str, space: Space, episode_length: int = 20, seed: int = 0, **switches: object
) -> Learner:
    """Make a learner.

    Args:
        name: One of :func:`names`, e.g. ``"psp"``.
        space: What is being learned.
        episode_length: Trials between two updates, at least 1.
        seed: 0 or more; the same seed and outcomes give the same proposals.
        switches: What the learner lets you choose; for ``psp`` the fields of
            :class:`shearline.learner.psp.config.PSPConfig`.

    Raises:
        UnknownLearnerError: If no learner has that name.
        SwitchError: If the learner has no such switch, or the switch no such value.
        LearnerError: If the episode length or the seed is out of range.

    Example:
        >>> from shearline.learner import create, Space
        >>> learner = create("lhs", Space.unit(2), episode_length=4, seed=1)
        >>> [p.trial for p in learner.ask(3)]
        [0, 1, 2]
    """
    resolved = resolve(name)
    module, _, attribute = {**LEARNERS, **EXTRAS, **UNLISTED}[resolved].partition(":")
    make = getattr(importlib.import_module(module), attribute)
    try:
        call = inspect.signature(make).bind(space, episode_length, seed, **switches)
    except TypeError:
        raise SwitchError(f"{resolved} has no switch {', '.join(switches)}: leave it out") from None
    return cast("Learner", make(*call.args, **call.kwargs))
