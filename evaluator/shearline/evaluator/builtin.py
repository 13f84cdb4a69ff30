"""Tasks that come with Shearline, by name; each is imported only when it is asked for.

These names may come over the wire: an evaluator started without a task takes the learner's.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping

import numpy as np

from shearline.evaluator.base import Array, Outcome, Task
from shearline.evaluator.keylock_variation import LEVELS, is_keylock
from shearline.evaluator.plants import DEFAULT
from shearline.protocol.errors import ConfigError
from shearline.protocol.task import TaskSpec

#: Longest stretch that the sleeping task sleeps without a beat [s].
_NAP_S = 0.05

#: Parameters of the benchmark functions, as in the paper's figure 4.
_BENCHMARK_N = 20

_BENCHMARKS = ("sphere", "rastrigin")
_SLEEP = re.compile(r"sleep(?:-(\d{1,6}))?")


def builtin_names() -> tuple[str, ...]:
    """Return the names that :func:`builtin_task` knows; a level may have switches behind it."""
    return (*LEVELS, *_BENCHMARKS, "sleep-MS")


def builtin_task(name: str, plant: str = DEFAULT) -> Task:
    """Return a built-in task, not yet warm.

    Args:
        name: One of :func:`builtin_names`.
        plant: What a task that has a plant acts on, one of :data:`~.plants.PLANTS`.

    Raises:
        ConfigError: If there is none of that name, or what it needs is not installed.
    """
    if is_keylock(name):
        return _keylock(name, plant)
    if name in _BENCHMARKS:
        return _benchmark(name)
    sleep = _SLEEP.fullmatch(name)
    if sleep is not None:
        return BowlTask(int(sleep[1] or 50))
    raise ConfigError(
        f"no task {name[:80]!r}: expected one of {', '.join(builtin_names())},"
        " or FILE:FUNCTION for a function of your own"
    )


def builtin_spec(name: str) -> TaskSpec:
    """Return what a built-in task is about, without loading what runs it.

    Raises:
        ConfigError: As :func:`builtin_task`.
    """
    if is_keylock(name):
        from shearline.evaluator.keylock_spec import keylock_spec  # noqa: PLC0415 - see module

        return keylock_spec(name)
    return builtin_task(name).spec


class BowlTask:
    """A bowl in two dimensions whose trials take a given wall time; for demonstrations and tests.

    The cost is the squared distance from the middle of a square of 10 m, and a trial succeeds
    within 3 m of it: 28 % of the square.

    Args:
        wall_ms: How long one trial takes [ms].
    """

    engine = "bowl 1"

    def __init__(self, wall_ms: int = 50) -> None:
        self._wall_s = wall_ms / 1000
        self.spec = TaskSpec(
            name=f"sleep-{wall_ms}",
            space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)},
            options={"ms": float(wall_ms)},
            trial_s=max(10.0, 10 * self._wall_s),
        )

    def warm(self) -> None:
        """Do nothing: there is nothing to load."""

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:  # noqa: ARG002
        """Sleep in naps, with a beat after each; see :class:`shearline.evaluator.base.Task`."""
        end_s = time.monotonic() + self._wall_s
        while (left_s := end_s - time.monotonic()) > 0:
            time.sleep(min(left_s, _NAP_S))
            beat()
        cost = float(np.sum(np.square(theta)))
        success = cost <= 9.0
        return Outcome(cost=cost, success=success, why="" if success else "far")


class BenchmarkTask:
    """A benchmark function on [-5, 5]^20 with its optimum off the middle; every trial succeeds.

    Args:
        name: ``"sphere"`` or ``"rastrigin"``.
    """

    engine = "functions 1"

    def __init__(self, name: str) -> None:
        from shearline.sims import functions  # noqa: PLC0415 - see module

        function = {"sphere": functions.sphere, "rastrigin": functions.rastrigin}[name]
        self._problem = functions.shifted(function, _BENCHMARK_N, seed=0)
        options: Mapping[str, str | float | bool] = {"optimum": 0.0}
        self.spec = TaskSpec(
            name=name, space=self._problem.space.spec(), options=dict(options), trial_s=10.0
        )

    def warm(self) -> None:
        """Do nothing: there is nothing to load."""

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:  # noqa: ARG002
        """Evaluate the function once; see :class:`shearline.evaluator.base.Task`."""
        cost, success = self._problem.trial(theta, np.random.default_rng(seed))
        return Outcome(cost=cost, success=success)


def _benchmark(name: str) -> Task:
    return BenchmarkTask(name)


def _keylock(name: str, plant: str) -> Task:
    from shearline.evaluator import keylock  # noqa: PLC0415 - see module

    return keylock.BulletKeylockTask(name) if plant == "pybullet" else keylock.KeylockTask(name)
