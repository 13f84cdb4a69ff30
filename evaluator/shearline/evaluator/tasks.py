"""Tasks by name: the user's own function, or one that comes with Shearline.

``@task`` declares a function to be a task; :func:`load_task` finds one by ``file:function``,
``module:function`` or the name of a built-in. Only what a person on this machine typed is ever
imported: a name that came over the wire reaches :func:`builtin_task` and nothing else.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import math
import numbers
import platform
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, TypeGuard, TypeVar

import numpy as np

from shearline.evaluator.base import Array, Outcome, Task, TrialAborted
from shearline.evaluator.builtin import builtin_names, builtin_task
from shearline.evaluator.plants import DEFAULT
from shearline.protocol.errors import ConfigError
from shearline.protocol.space import Space
from shearline.protocol.task import TaskSpec

F = TypeVar("F", bound=Callable[..., Any])

#: Longest wall time of one call, unless the task says otherwise [s].
TRIAL_S = 60.0

_MARK = "__shearline_task__"


@dataclass(frozen=True, slots=True)
class Declared:
    """What ``@task`` says about a function."""

    space: Space
    trial_s: float = TRIAL_S
    options: Mapping[str, str | float | bool] = field(default_factory=dict)


def task(
    space: Mapping[str, tuple[str, float, float]],
    trial_s: float = TRIAL_S,
    options: Mapping[str, str | float | bool] | None = None,
) -> Callable[[F], F]:
    """Declare a function to be a task; it stays the function it was.

    The function takes ``theta``, a dict from parameter name to float, and ``rng``, a
    :class:`numpy.random.Generator` seeded for each trial. It returns ``cost, success`` or
    ``cost, success, extras`` with a dict of further numbers. An exception in it is an aborted
    trial with its message, never a cost.

    Args:
        space: Parameter name to ``(unit, low, high)``.
        trial_s: Longest wall time of one call [s]. A call that takes longer cannot be stopped:
            its process ends, and whoever started it starts another.
        options: Whatever else decides the cost; learner and evaluators must agree on it.

    Raises:
        SpaceError: If the space is malformed.
        ConfigError: If ``trial_s`` is not a positive number of seconds.

    Example:
        >>> @task(space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)})
        ... def bowl(theta, rng):
        ...     return theta["x"] ** 2 + theta["y"] ** 2, True
    """
    if not 0.0 < trial_s <= 86400.0:
        raise ConfigError(f"expected trial_s from 0 to 86400 s, got {trial_s!r}: correct the task")
    declared = Declared(Space(space), float(trial_s), dict(options or {}))

    def mark(function: F) -> F:
        setattr(function, _MARK, declared)
        return function

    return mark


class FunctionTask:
    """The user's function as a task.

    It cannot beat: leases are renewed for it while it runs, for ``trial_s`` and no longer.

    Args:
        function: One that ``@task`` declared.
        name: How learner and evaluators both call it.

    Raises:
        ConfigError: If the function was not declared.
    """

    def __init__(self, function: Callable[..., Any], name: str) -> None:
        declared = getattr(function, _MARK, None)
        if not isinstance(declared, Declared):
            raise ConfigError(f"{name} is not a task: put @task(space={{...}}) above it")
        self._function = function
        self._names = declared.space.names
        python = ".".join(platform.python_version_tuple()[:2])
        self._engine = f"python {python} function {name} {_source_digest(function)}"
        self._spec = TaskSpec(
            name=name,
            space=declared.space.spec(),
            options=dict(declared.options),
            trial_s=declared.trial_s,
        )

    @property
    def spec(self) -> TaskSpec:
        """Name, space and options."""
        return self._spec

    @property
    def engine(self) -> str:
        """Python's version, the function and a digest of the file it stands in."""
        return self._engine

    def warm(self) -> None:
        """Do nothing: what a function loads, only a call of it would tell."""

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:  # noqa: ARG002
        """Call the function once.

        Raises:
            TrialAborted: If it raises, or returns anything but a cost, a success and extras.
        """
        named = dict(zip(self._names, theta.tolist(), strict=True))
        try:
            returned = self._function(named, np.random.default_rng(seed))
        except TrialAborted:
            raise
        except (Exception, SystemExit) as fault:
            raise TrialAborted(f"{type(fault).__name__}: {fault}") from fault
        return outcome_of(returned)


def outcome_of(returned: object) -> Outcome:
    """Read what a user's function returned.

    Raises:
        TrialAborted: If it is not ``cost, success`` or ``cost, success, extras``.
    """
    match returned:
        case (cost, success):
            extras: object = {}
        case (cost, success, extras):
            pass
        case _:
            raise TrialAborted(
                f"expected (cost, success) or (cost, success, extras), got {_short(returned)}"
            )
    if not _is_number(cost) or not math.isfinite(cost):
        raise TrialAborted(f"expected a finite number as cost, got {_short(cost)}")
    if not isinstance(success, bool | np.bool_):
        raise TrialAborted(f"expected True or False as success, got {_short(success)}")
    if not isinstance(extras, Mapping) or not all(
        isinstance(name, str) and _is_number(value) for name, value in extras.items()
    ):
        raise TrialAborted(f"expected extras as a dict of numbers, got {_short(extras)}")
    return Outcome(
        cost=float(cost),
        success=bool(success),
        extras={name: float(value) for name, value in extras.items()},
    )


def load_task(name: str, plant: str = DEFAULT) -> Task:
    """Return the task that a person on this machine named.

    Args:
        name: A built-in's name, ``"my_file:bowl"``, ``"my_file.py:bowl"`` (a file in the current
            folder, or a path) or ``"my_lab.tasks:grind"`` (a module).
        plant: What a built-in that has a plant acts on.

    Raises:
        ConfigError: If there is no such task, or its file cannot be imported.
    """
    where, colon, function = name.partition(":")
    if not colon:
        return builtin_task(name, plant)
    built_in = f"a built-in ({', '.join(builtin_names())}) or FILE:FUNCTION"
    module, called = import_code(where, built_in)
    found = getattr(module, function, None)
    if not callable(found):
        tasks = [f"{called}:{key}" for key, value in vars(module).items() if hasattr(value, _MARK)]
        raise ConfigError(
            f"no function {function!r} in {where}: expected one of {', '.join(tasks) or 'none'}"
        )
    return FunctionTask(found, f"{called}:{function}")


def import_code(where: str, expected: str) -> tuple[ModuleType, str]:
    """Import a file or a module that a person named; return it and the name it goes by.

    Args:
        where: A file, with or without its ``.py``, or a module.
        expected: What might have been named instead; said if there is neither.

    Raises:
        ConfigError: If there is none, or it cannot be imported.
    """
    path = Path(where if where.endswith(".py") else f"{where}.py")
    try:
        if path.is_file():
            return _import_file(path), path.stem
        _look_in(Path.cwd())
        return importlib.import_module(where), where
    except ModuleNotFoundError as missing:
        if missing.name is not None and where.startswith(missing.name):
            raise ConfigError(
                f"no file {path} in {Path.cwd()} and no module {where!r}: expected {expected}"
            ) from None
        raise ConfigError(f"{where} cannot be imported: {missing}") from None
    except SyntaxError as fault:
        raise ConfigError(
            f"{fault.filename} line {fault.lineno} is not Python: {fault.msg}"
        ) from None
    except (Exception, SystemExit) as fault:  # noqa: BLE001 - it is the user's file
        raise ConfigError(f"{where} cannot be imported: {type(fault).__name__}: {fault}") from None


def _import_file(path: Path) -> ModuleType:
    resolved = path.resolve()
    known = sys.modules.get(path.stem)
    if known is not None and getattr(known, "__file__", None) == str(resolved):
        return known
    # A file may bear the name of a module that is in use; it must not replace it.
    name = path.stem if known is None else f"_shearline_task_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, resolved)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    _look_in(resolved.parent)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _look_in(folder: Path) -> None:
    """Let a file import its neighbours, as a script may."""
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))


def _source_digest(function: Callable[..., Any]) -> str:
    """Return 12 hexadecimal digits of the whole file: helpers beside a function matter too."""
    try:
        path = inspect.getsourcefile(function)
        source = Path(path or "").read_bytes()
    except (OSError, TypeError):
        return "unknown"
    return hashlib.sha256(source).hexdigest()[:12]


def _is_number(value: object) -> TypeGuard[numbers.Real]:
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:80]}..."
