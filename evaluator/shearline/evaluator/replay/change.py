"""What if: other values for some parameters of a recorded trial, or another seed.

Parses what a person types, by name and unit, and keeps it within the bounds of the space.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from shearline.protocol.errors import ConfigError
from shearline.protocol.space import Parameter, Space

#: A number, and whatever stands behind it.
_VALUE = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


@dataclass(frozen=True, slots=True)
class Change:
    """What is to be different from the recorded trial.

    Attributes:
        values: Parameter name to value, in task units.
        seed: Another seed, or ``None`` for the recorded one.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    seed: int | None = None

    def __bool__(self) -> bool:
        return bool(self.values) or self.seed is not None

    def applied(self, space: Space, theta: tuple[float, ...]) -> tuple[float, ...]:
        """Return the tuple ``(n,)`` with the changed values in it."""
        named = space.to_dict(theta) | dict(self.values)
        return tuple(space.to_array(named).tolist())


def change_of(space: Space, typed: Iterable[str], seed: int | None = None) -> Change:
    """Parse ``NAME=VALUE`` words.

    Args:
        space: The task's.
        typed: E.g. ``"ins_push=12"``, ``"ins_push=12 N"``; the end of a name behind an underscore
            will do (``"push=12"``) where only one parameter ends so.
        seed: Another seed.

    Raises:
        ConfigError: If a word is no such pair, a name is unknown, ambiguous or given twice, a unit
            is not the parameter's, or a value is out of bounds.
    """
    values: dict[str, float] = {}
    for word in typed:
        name, equals, text = word.partition("=")
        if not equals:
            raise ConfigError(f"expected NAME=VALUE, e.g. {space.names[0]}=1, got {word!r}")
        parameter = _parameter(space, name.strip())
        if parameter.name in values:
            raise ConfigError(f"{parameter.name} was given twice: give it once")
        values[parameter.name] = _value(parameter, text)
    return Change(values, seed)


def _parameter(space: Space, name: str) -> Parameter:
    if name in space.names:
        return space[name]
    found = [known for known in space.names if known.endswith(f"_{name}")]
    if len(found) == 1:
        return space[found[0]]
    if found:
        raise ConfigError(f"{name!r} may be {' or '.join(found)}: write the whole name")
    raise ConfigError(f"no parameter {name!r} in this run: expected one of {_listed(space)}")


def _value(parameter: Parameter, text: str) -> float:
    found = _VALUE.fullmatch(text)
    if found is None:
        raise ConfigError(f"expected a number for {_bounds(parameter)}, got {text.strip()!r}")
    value, unit = float(found[1]), found[2]
    if unit not in {"", parameter.unit}:
        raise ConfigError(
            f"expected {parameter.name} in {parameter.unit or 'no unit'}, got {unit!r}: convert it"
        )
    if not parameter.low <= value <= parameter.high:
        raise ConfigError(f"expected {_bounds(parameter)}, got {value:g}")
    return value


def _bounds(p: Parameter) -> str:
    return f"{p.name} from {p.low:g} to {p.high:g} {p.unit}".rstrip()


def _listed(space: Space) -> str:
    return ", ".join(f"{p.name} [{p.unit}]" if p.unit else p.name for p in space)
