"""Every number of the ranked learner, as one documented value."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

from shearline.learner.errors import SwitchError


@dataclass(frozen=True, slots=True)
class RankedConfig:
    """Switches and numbers; docs/learners.md says what each is worth.

    Attributes:
        refresh: Trials between two renewals of the model within an episode, for when results
            come one by one; 0 renews it once per episode.
        wins_min: Successes from which there is a model; with fewer the space is scouted.
        scout_spread: Deviation, in edges of the cube, of scouts around a lone success.
        pessimism: Posterior deviations by which the log-odds of success are taken too low.
        spread: Factor on the deviations of the elite when drawing.
        widening: Most by which that factor grows while the elite is not reliable.
        floor: Mean deviation below which the draws do not narrow where all of the cost is noise, in
            edges of the cube; where the model explains it, in proportion less.
        moves: How often an update moves the middle to the best of the model's own draws.
        draws: Proposals that are ranked for each trial; 1 ranks nothing.
        reliability: Whether the ranking knows the chance of success; for comparison.
        cost: Whether the elite is chosen by the model of cost, or by each success's own cost; for
            comparison.
        window: Trials that the reliability looks at.
        cost_window: Successes that the cost looks at.
    """

    refresh: int = 0
    wins_min: int = 4
    scout_spread: float = 0.2
    pessimism: float = 0.5
    spread: float = 1.0
    widening: float = 0.3
    floor: float = 0.1
    moves: int = 2
    draws: int = 30
    reliability: bool = True
    cost: bool = True
    window: int = 1000
    cost_window: int = 240

    def __post_init__(self) -> None:
        _check(self.refresh >= 0, "refresh", "0 or more", self.refresh)
        _check(self.wins_min >= 2, "wins_min", "2 or more", self.wins_min)
        _check(self.scout_spread > 0, "scout_spread", "above 0", self.scout_spread)
        _check(self.pessimism >= 0, "pessimism", "0 or more", self.pessimism)
        _check(self.spread > 0, "spread", "above 0", self.spread)
        _check(self.widening >= 0, "widening", "0 or more", self.widening)
        _check(0 <= self.floor <= 1, "floor", "0 to 1", self.floor)
        _check(0 <= self.moves <= 100, "moves", "0 to 100", self.moves)
        _check(1 <= self.draws <= 10_000, "draws", "1 to 10000", self.draws)
        _check(self.window >= 10, "window", "10 or more", self.window)
        _check(self.cost_window >= 10, "cost_window", "10 or more", self.cost_window)

    def having(self, **switches: object) -> Self:
        """Return a copy with switches changed.

        Raises:
            SwitchError: If there is no such switch or it has no such value.
        """
        known = {f.name: getattr(self, f.name) for f in fields(self)}
        for name, value in switches.items():
            if name not in known:
                raise SwitchError(
                    f"psp-ranked has no switch {name!r}: expected one of {', '.join(known)}"
                )
            known[name] = _like(name, known[name], value)
        return type(self)(**known)


def _like(name: str, default: object, value: object) -> object:
    """Return a value of the kind that a switch's default has."""
    if isinstance(default, float) and isinstance(value, int | float) and not _is_bool(value):
        return float(value)
    if isinstance(default, int) and isinstance(value, int) and _is_bool(value) == _is_bool(default):
        return value
    raise SwitchError(f"psp-ranked's switch {name!r} takes a value like {default!r}, got {value!r}")


def _is_bool(value: object) -> bool:
    return isinstance(value, bool)


def _check(holds: bool, name: str, expected: str, got: object) -> None:  # noqa: FBT001
    if not holds:
        raise SwitchError(f"psp-ranked's switch {name!r} takes {expected}, got {got!r}")
