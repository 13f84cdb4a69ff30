"""Who takes part in the studies on the lock: a learner and its switches under one name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from shearline.learner.registry import ALIASES, EXTRAS
from shearline.protocol.errors import ConfigError
from shearline.protocol.space import Space

#: Push of ``centre-push`` [N]: the one parameter that nearly solves the mild level by itself.
PUSH_N = 19.0


@dataclass(frozen=True, slots=True)
class Contender:
    """A row of the tables.

    Attributes:
        name: Of the row.
        learner: Name of the learner.
        switches: What is chosen for it, for the space and number of trials of an experiment.
    """

    name: str
    learner: str
    switches: Callable[[Space, int], Mapping[str, object]] = field(default=lambda _, __: {})


def _pushed(space: Space, trials: int) -> Mapping[str, object]:
    """Return a plan of one tuple over and over: the middle of the box, with a firm push."""
    middle = (space.low + space.high) / 2.0
    named = space.to_dict(middle) | ({"ins_push": PUSH_N} if "ins_push" in space.names else {})
    return {"tuples": [space.to_array(named).tolist()] * trials}


_ALL = (
    Contender("psp-ranked", "psp-ranked"),
    Contender("psp", "psp"),
    Contender("psp-paper", "psp-paper"),
    Contender("hireps", "hireps"),
    Contender("cmaes", "cmaes"),
    # The public code of the paper's authors starts there (MIOS, .1 of each range).
    Contender("cmaes-low", "cmaes", lambda _, __: {"start": 0.1}),
    Contender("ga", "ga"),
    Contender("pso", "pso"),
    Contender("tpe", "tpe"),
    Contender("random", "random"),
    Contender("centre-push", "plan", _pushed),
)
CONTENDERS: Mapping[str, Contender] = MappingProxyType({one.name: one for one in _ALL})
#: Those that every install has; the others take part when they are asked for.
USUAL = tuple(name for name, one in CONTENDERS.items() if one.learner not in EXTRAS)


def contender(name: str) -> Contender:
    """Return the contender of a name; ``best`` is the learner we would use ourselves.

    Raises:
        ConfigError: If there is none.
    """
    found = CONTENDERS.get(ALIASES.get(name, name))
    if found is None:
        raise ConfigError(f"no contender {name!r}: expected some of {', '.join(CONTENDERS)}")
    return found
