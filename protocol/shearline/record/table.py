"""The trials of a run as columns: arrays by name, each with its unit.

What a data frame is made of, without being one. Nothing here reads files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from shearline.protocol.messages import Counted, OutcomeKind

Column = npt.NDArray[Any]

#: Units of the columns that every run has, where they have one.
UNITS = {"wall_s": "s", "at_s": "s"}


@dataclass(frozen=True, eq=False)
class Table(Mapping[str, Column]):
    """One row per trial that reached its outcome, in order of trial number.

    A mapping of column names to arrays ``(trials,)``, so that ``pandas.DataFrame(dict(table))``
    is a data frame. Columns are ``trial, episode, outcome, success, cost, evaluator,
    evaluator_kind, attempts, seed, engine, digest, wall_s, late, why, at_s, purpose``, then
    ``theta.NAME`` for each parameter and ``extras.NAME`` for each further number. What a trial
    does not have is ``nan``: the cost of a lost one, an extra that only others said.

    Attributes:
        columns: Name to values.
        units: Name to unit, ``""`` where a column has none.
    """

    columns: dict[str, Column]
    units: dict[str, str]

    @property
    def theta(self) -> npt.NDArray[np.float64]:
        """The tuples ``(trials, parameters)`` in task units."""
        names = [name for name in self.columns if name.startswith("theta.")]
        rows = len(self.columns["trial"])
        if not names:
            return np.zeros((rows, 0))
        return np.stack([self.columns[name] for name in names], axis=1)

    def __getitem__(self, name: str) -> Column:
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)


def table_of(outcomes: Sequence[Counted], names: Sequence[str], units: Sequence[str]) -> Table:
    """Return outcomes as columns.

    Args:
        outcomes: One per trial.
        names: Parameter names, in the order of every ``theta``.
        units: One for each parameter.
    """
    theta = np.array(
        [_fitted(outcome.theta, len(names)) for outcome in outcomes], dtype=np.float64
    ).reshape(len(outcomes), len(names))
    columns = _facts(outcomes)
    columns |= {f"theta.{name}": theta[:, i] for i, name in enumerate(names)}
    for extra in sorted({name for outcome in outcomes for name in outcome.extras}):
        values = [outcome.extras.get(extra, math.nan) for outcome in outcomes]
        columns[f"extras.{extra}"] = np.array(values, dtype=np.float64)
    named = {f"theta.{name}": unit for name, unit in zip(names, units, strict=True)}
    return Table(columns, {name: named.get(name, UNITS.get(name, "")) for name in columns})


def _facts(outcomes: Sequence[Counted]) -> dict[str, Column]:
    kinds = [outcome.kind for outcome in outcomes]
    costs = [outcome.cost if outcome.kind else math.nan for outcome in outcomes]
    return {
        "trial": _column(outcomes, "trial", np.int64),
        "episode": _column(outcomes, "episode", np.int64),
        "outcome": np.array([kind.value if kind else "lost" for kind in kinds], dtype=np.str_),
        "success": np.array([kind is OutcomeKind.SUCCESS for kind in kinds], dtype=np.bool_),
        "cost": np.array(costs, dtype=np.float64),
        "evaluator": _column(outcomes, "evaluator", np.str_),
        "evaluator_kind": _column(outcomes, "evaluator_kind", np.str_),
        "attempts": _column(outcomes, "attempts", np.int64),
        "seed": _column(outcomes, "seed", np.int64),
        "engine": _column(outcomes, "engine", np.str_),
        "digest": _column(outcomes, "digest", np.str_),
        "wall_s": _column(outcomes, "wall_s", np.float64),
        "late": _column(outcomes, "late", np.bool_),
        "why": _column(outcomes, "why", np.str_),
        "at_s": _column(outcomes, "at_s", np.float64),
        "purpose": np.array([outcome.purpose.value for outcome in outcomes], dtype=np.str_),
    }


def _column(outcomes: Sequence[Counted], field: str, dtype: npt.DTypeLike) -> Column:
    return np.array([getattr(outcome, field) for outcome in outcomes], dtype=dtype)


def _fitted(theta: Sequence[float], n: int) -> list[float]:
    """Return a tuple of ``n`` numbers, whatever a damaged head made of their names."""
    return [*theta[:n], *([math.nan] * (n - len(theta)))]
