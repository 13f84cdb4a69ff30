"""Switches: a learner's choices as a frozen dataclass, changed by name with words and numbers.

It checks that a switch exists and that its value is of the kind the default has; what range a
number may have is the business of the dataclass.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

from shearline.learner.errors import SwitchError

C = TypeVar("C")


def having(config: C, learner: str, switches: Mapping[str, object]) -> C:
    """Return a copy of a dataclass with switches changed; words stand for enum members.

    Args:
        config: The defaults, a dataclass.
        learner: Whose they are, for messages.
        switches: Field name to value.

    Raises:
        SwitchError: If there is no such switch or it has no such value.
    """
    known: dict[str, Any] = {f.name: getattr(config, f.name) for f in fields(config)}  # type: ignore[arg-type]  # a TypeVar cannot be bound to "dataclass"
    for name, value in switches.items():
        if name not in known:
            raise SwitchError(
                f"{learner} has no switch {name!r}: expected one of {', '.join(known)}"
            )
        known[name] = _like(learner, name, known[name], value)
    return type(config)(**known)


def plain(config: object) -> dict[str, object]:
    """Return a dataclass of switches as numbers, strings and lists, for a snapshot."""
    return {f.name: _plain(getattr(config, f.name)) for f in fields(config)}  # type: ignore[arg-type]  # as above


def check(holds: bool, learner: str, name: str, expected: str, got: object) -> None:  # noqa: FBT001 - the condition reads first, as in an assertion
    """Refuse a switch's value unless a condition holds.

    Raises:
        SwitchError: If it does not.
    """
    if not holds:
        raise SwitchError(f"{learner}'s switch {name!r} takes {expected}, got {got!r}")


def _like(learner: str, name: str, default: object, value: object) -> object:
    """Return a value of the kind that a switch's default has."""
    if isinstance(default, enum.StrEnum):
        allowed = [str(member) for member in type(default)]
        check(value in allowed, learner, name, f"one of {', '.join(allowed)}", value)
        return type(default)(str(value))
    match default, value:
        case (bool(), bool()) | (tuple(), tuple()):
            return value
        case (tuple(), list()):
            return tuple(value)
        case (float(), int() | float()) if not isinstance(value, bool):
            return float(value)
        case (int(), int()) if isinstance(default, bool) == isinstance(value, bool):
            return value
    raise SwitchError(f"{learner}'s switch {name!r} takes a value like {default!r}, got {value!r}")


def _plain(value: object) -> object:
    match value:
        case tuple():
            return list(value)
        case str():
            return str(value)
    return value
