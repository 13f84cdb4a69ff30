"""Parameter space: names, units and bounds of what is being learned.

Two coordinates are used throughout. *Task* coordinates carry the units of the task; *unit*
coordinates are the same point in the hypercube [0, 1]^n in which learners work. Nothing here
knows how a trial is run or what it costs.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.protocol.errors import SpaceError

Array = npt.NDArray[np.float64]

#: More parameters than any task here has; bounds every message that carries a tuple.
PARAMETERS_MAX = 1024


@dataclass(frozen=True, slots=True)
class Parameter:
    """One axis of the space.

    Args:
        name: Identifier, unique in its space.
        unit: SI unit or ``""`` for a pure number, e.g. ``"N m/rad"``.
        low: Smallest admissible value, in ``unit``.
        high: Largest admissible value, in ``unit``; must exceed ``low``.

    Raises:
        SpaceError: If the name is not an identifier or the bounds are not finite and ordered.
    """

    name: str
    unit: str
    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.name.isidentifier():
            raise SpaceError(
                f"expected a parameter name that is an identifier, got {self.name!r}: rename it"
            )
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise SpaceError(
                f"parameter {self.name!r} needs finite bounds with low < high,"
                f" got low={self.low!r}, high={self.high!r}: correct the bounds"
            )


class Space:
    """An ordered box of named parameters.

    Args:
        parameters: Name to ``(unit, low, high)``, in the order of the tuple's components.

    Raises:
        SpaceError: If it is empty, too large, or a parameter is malformed.

    Example:
        >>> space = Space({"push": ("N", 0.0, 20.0), "k_rot": ("N m/rad", 5.0, 200.0)})
        >>> space.denormalise([0.5, 0.0]).tolist()
        [10.0, 5.0]
    """

    __slots__ = ("_index", "high", "highs", "low", "lows", "parameters")

    def __init__(self, parameters: Mapping[str, tuple[str, float, float]]) -> None:
        if not 1 <= len(parameters) <= PARAMETERS_MAX:
            raise SpaceError(
                f"a space has 1 to {PARAMETERS_MAX} parameters, got {len(parameters)}: name them"
            )
        self.parameters: tuple[Parameter, ...] = tuple(
            _parameter(name, spec) for name, spec in parameters.items()
        )
        #: Bounds as plain numbers: for one tuple a walk through them is faster than arrays.
        self.lows: tuple[float, ...] = tuple(p.low for p in self.parameters)
        self.highs: tuple[float, ...] = tuple(p.high for p in self.parameters)
        self.low: Array = _frozen(self.lows)
        self.high: Array = _frozen(self.highs)
        self._index = {p.name: i for i, p in enumerate(self.parameters)}

    @classmethod
    def box(cls, n: int, low: float, high: float) -> Space:
        """Return ``n`` unitless parameters ``x0..`` that share the bounds ``[low, high]``."""
        return cls({f"x{i}": ("", low, high) for i in range(n)})

    @classmethod
    def unit(cls, n: int) -> Space:
        """Return the hypercube [0, 1]^n."""
        return cls.box(n, 0.0, 1.0)

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names, in order."""
        return tuple(p.name for p in self.parameters)

    @property
    def units(self) -> tuple[str, ...]:
        """Parameter units, in order."""
        return tuple(p.unit for p in self.parameters)

    def normalise(self, theta: npt.ArrayLike) -> Array:
        """Map task coordinates ``(..., n)`` to unit coordinates ``(..., n)``."""
        return (self._shaped(theta) - self.low) / (self.high - self.low)

    def denormalise(self, u: npt.ArrayLike) -> Array:
        """Map unit coordinates ``(..., n)`` to task coordinates ``(..., n)``.

        Points of the cube land inside the bounds to the last bit.
        """
        unit = self._shaped(u)
        theta = self.low + unit * (self.high - self.low)
        inside = (unit >= 0.0) & (unit <= 1.0)
        return np.where(inside, np.clip(theta, self.low, self.high), theta)

    def contains(self, theta: npt.ArrayLike) -> bool:
        """Tell whether one tuple ``(n,)`` in task coordinates is finite and within bounds."""
        t = self._shaped(theta)
        return bool(np.all((t >= self.low) & (t <= self.high)))

    def to_array(self, values: Mapping[str, float]) -> Array:
        """Order named values into a tuple ``(n,)``.

        Raises:
            SpaceError: If a name is missing or unknown.
        """
        if set(values) != set(self._index):
            missing = sorted(set(self._index) - set(values))
            unknown = sorted(set(values) - set(self._index))
            raise SpaceError(
                f"a tuple names each parameter once; missing {missing}, unknown {unknown}:"
                f" expected {', '.join(self.names)}"
            )
        return np.array([values[name] for name in self.names], dtype=np.float64)

    def to_dict(self, theta: npt.ArrayLike) -> dict[str, float]:
        """Name the components of one tuple ``(n,)`` in task coordinates."""
        return dict(zip(self.names, self._shaped(theta).tolist(), strict=True))

    def spec(self) -> dict[str, tuple[str, float, float]]:
        """Return the mapping that would build this space again."""
        return {p.name: (p.unit, p.low, p.high) for p in self.parameters}

    def digest(self) -> str:
        """Return 16 hexadecimal digits; any change of name, unit, bound or order changes them."""
        text = "\n".join(
            f"{p.name}\t{p.unit}\t{p.low.hex()}\t{p.high.hex()}" for p in self.parameters
        )
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def _shaped(self, values: npt.ArrayLike) -> Array:
        array = np.asarray(values, dtype=np.float64)
        if array.ndim == 0 or array.shape[-1] != len(self):
            raise SpaceError(
                f"expected {len(self)} components in the last axis, got shape {array.shape}"
            )
        return array

    def __len__(self) -> int:
        return len(self.parameters)

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self.parameters)

    def __getitem__(self, name: str) -> Parameter:
        try:
            return self.parameters[self._index[name]]
        except KeyError:
            raise SpaceError(
                f"no parameter {name!r} in this space: expected one of {', '.join(self.names)}"
            ) from None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Space) and self.parameters == other.parameters

    def __hash__(self) -> int:
        return hash(self.parameters)

    def __repr__(self) -> str:
        return f"Space({self.spec()!r})"


def _parameter(name: str, spec: Sequence[object]) -> Parameter:
    match spec:
        case (str(unit), int() | float() as low, int() | float() as high):
            return Parameter(str(name), unit, float(low), float(high))
    raise SpaceError(f"parameter {name!r} needs (unit, low, high), got {spec!r}")


def _frozen(values: Sequence[float]) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
