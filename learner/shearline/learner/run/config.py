"""What was asked for: everything that decides a run, as one frozen value and as TOML.

``run.toml`` in a run folder and the file given to ``shearline learner`` are the same format; only
the first always spells the task out. This module does not know tasks by name: whoever does gives
a function for that.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from typing import Annotated, Any, Literal

import msgspec
import tomli_w
from msgspec import Meta

from shearline.learner.dispatcher.rules import Rules
from shearline.learner.prior import Prior
from shearline.protocol.errors import ConfigError
from shearline.protocol.space import Space
from shearline.protocol.task import TaskSpec, digest

#: Proposals of one episode travel in one journal entry and fit into memory many times over.
TRIALS_MAX = 100_000


class RunConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Everything that decides a run.

    Attributes:
        task: What is being learned.
        learner: Name of the learner, e.g. ``"psp"``.
        switches: What that learner lets one choose, by name, e.g. ``{"svm_c": 1000.0}``.
        episodes: Updates of the learner.
        trials: Trials of each episode.
        seed: Decides proposals and trial seeds.
        lease_s: An attempt not renewed for so long is given out again [s].
        speculative: Whether a slow attempt on a simulator may be copied to an idle one.
        quorum: Share of an episode's trials that may close it after ``quorum_after_s``.
        quorum_after_s: See ``quorum`` [s].
        losses_max: Attempts of one trial that may lapse before it counts as lost.
        aborts_max: Attempts of one trial that may be aborted or rejected before it does.
        stop_grace_s: How long a stop waits for what runs [s].
        kinds: Kinds of evaluators that may take part; all if empty.
        confirm: Trials spent on the recommended tuple once the last episode has closed; the
            learner is not told of them.
        confirm_on: Kind of evaluators that alone confirm; any if empty.
        confirm_region: Trials spent on draws from the recommended region after those, likewise.
        warm_start: Trials of another run that the learner starts from.
        record: Whether the run is recorded beside its journal.
        durable: Whether an acknowledged result survives a power cut, not only the process: each
            step of the learner then waits for the disk.
    """

    task: TaskSpec
    learner: Annotated[str, Meta(min_length=1, max_length=64)] = "psp-ranked"
    switches: dict[str, Any] = {}
    episodes: Annotated[int, Meta(ge=1, le=1_000_000)] = 10
    trials: Annotated[int, Meta(ge=1, le=TRIALS_MAX)] = 20
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    lease_s: Annotated[float, Meta(ge=0.1, le=3600.0)] = 2.0
    speculative: bool = True
    quorum: Annotated[float, Meta(gt=0.0, le=1.0)] = 1.0
    quorum_after_s: Annotated[float, Meta(ge=0.0, le=1e6)] = 60.0
    losses_max: Annotated[int, Meta(ge=1, le=50)] = 3
    aborts_max: Annotated[int, Meta(ge=1, le=50)] = 3
    stop_grace_s: Annotated[float, Meta(ge=0.0, le=3600.0)] = 5.0
    kinds: tuple[Literal["simulator", "function", "robot"], ...] = ()
    confirm: Annotated[int, Meta(ge=0, le=TRIALS_MAX)] = 0
    confirm_on: Literal["", "simulator", "function", "robot"] = ""
    confirm_region: Annotated[int, Meta(ge=0, le=TRIALS_MAX)] = 0
    warm_start: Prior = Prior()
    record: bool = True
    durable: bool = False

    @property
    def space(self) -> Space:
        """The parameter space of the task.

        Raises:
            SpaceError: If it is malformed.
        """
        return Space(self.task.space)

    def rules(self) -> Rules:
        """Return what the dispatcher keeps to."""
        return Rules(
            task=self.task,
            episodes=self.episodes,
            trials=self.trials,
            lease_s=self.lease_s,
            speculative=self.speculative,
            quorum=self.quorum,
            quorum_after_s=self.quorum_after_s,
            losses_max=self.losses_max,
            aborts_max=self.aborts_max,
            stop_grace_s=self.stop_grace_s,
            kinds=self.kinds,
            confirm=self.confirm,
            confirm_on=self.confirm_on,
            confirm_region=self.confirm_region,
        )


def to_toml(config: RunConfig) -> str:
    """Write a configuration as TOML that :func:`from_toml` reads back to the same value."""
    values = msgspec.to_builtins(config)
    if not config.warm_start:
        del values["warm_start"]
    return tomli_w.dumps(values)


def from_toml(text: str, task: Callable[[str], TaskSpec] | None = None) -> RunConfig:
    """Read a configuration.

    Args:
        text: TOML; ``task`` is a table, or a name if ``task`` can resolve it.
        task: Returns the task of a name.

    Raises:
        ConfigError: If it is not TOML, or a value is missing, unknown or out of range.
        SpaceError: If the task's space is malformed.
    """
    try:
        values: dict[str, Any] = tomllib.loads(text)
    except tomllib.TOMLDecodeError as fault:
        raise ConfigError(f"expected TOML, got {fault}: correct the file") from None
    name = values.get("task")
    if isinstance(name, str):
        if task is None:
            raise ConfigError(f"expected the task spelled out as a table, got its name {name!r}")
        values["task"] = msgspec.to_builtins(task(name))
    return checked(values)


def checked(values: dict[str, Any]) -> RunConfig:
    """Make a configuration of plain values.

    Raises:
        ConfigError: If a value is missing, unknown or out of range.
        SpaceError: If the task's space is malformed.
    """
    try:
        config = msgspec.convert(values, RunConfig)
    except msgspec.ValidationError as fault:
        raise ConfigError(f"this configuration cannot be run: {fault}") from None
    space = Space(config.task.space)
    if any(len(theta) != len(space) for theta in config.warm_start.theta):
        raise ConfigError(
            f"this configuration cannot be run: a warm start needs tuples of {len(space)} values"
        )
    if config.confirm_on and config.kinds and config.confirm_on not in config.kinds:
        raise ConfigError(
            f"only evaluators of kind {', '.join(config.kinds)} may take part, so none of kind"
            f" {config.confirm_on} could confirm: correct kinds or confirm_on"
        )
    return config


def difference(asked: RunConfig, found: RunConfig) -> str:
    """Name the first thing that would make one run another, or return nothing.

    What only decides how it is run (leases, speculation, record) may change at a resume.
    """
    for field in (
        "learner",
        "episodes",
        "trials",
        "seed",
        "confirm",
        "confirm_on",
        "confirm_region",
    ):
        was, wanted = getattr(found, field), getattr(asked, field)
        if was != wanted:
            return f"its {field} is {was!r}, not {wanted!r}"
    if found.switches != asked.switches:
        return f"its learner has other switches ({', '.join(found.switches) or 'none'})"
    if found.warm_start != asked.warm_start:
        return f"it starts from {found.warm_start.run or 'nothing'}, or from other trials of it"
    if digest(found.task) != digest(asked.task):
        return f"its task is {found.task.name!r} with other bounds or options, or another task"
    return ""
