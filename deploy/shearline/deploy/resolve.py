"""From what was typed to what is run: arguments and a TOML file become one configuration.

This is where task names meet tasks: the learner may not know evaluators, the command line may.
"""

from __future__ import annotations

import argparse
import re
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from shearline.deploy.warm import prior_of
from shearline.evaluator.tasks import load_task
from shearline.learner.registry import resolve
from shearline.learner.run.config import RunConfig, checked
from shearline.protocol.errors import ConfigError

#: Arguments that override what the file says, by the configuration's field.
OVERRIDES = {
    "learner": "learner",
    "episodes": "episodes",
    "trials": "trials",
    "seed": "seed",
    "confirm": "confirm",
    "confirm_region": "confirm_region",
    "lease": "lease_s",
}


@dataclass(frozen=True, slots=True)
class Asked:
    """What was asked for.

    Attributes:
        config: What to run.
        run_dir: The folder to keep it in.
        own_task: ``file:function`` as it was typed, or ``None`` for a built-in.
    """

    config: RunConfig
    run_dir: Path
    own_task: str | None


def resolve_run(arguments: argparse.Namespace) -> Asked:
    """Return what was asked for.

    A folder that already holds a run says what it is; a file comes next, arguments last.

    Raises:
        ConfigError: If it does not add up to a run.
        SpaceError: If the task's space is malformed.
    """
    kept = Path(arguments.out, "run.toml") if arguments.out else None
    values = _read(kept) if kept and kept.exists() else {}
    if arguments.config is not None:
        values |= _read(arguments.config)
    values |= {
        field: getattr(arguments, name)
        for name, field in OVERRIDES.items()
        if getattr(arguments, name) is not None
    }
    if arguments.confirm_on is not None:
        if arguments.confirm is not None:
            raise ConfigError("--confirm-on says how many, too: leave --confirm out")
        values["confirm_on"], values["confirm"] = arguments.confirm_on
    if arguments.task is not None:
        values["task"] = arguments.task
    if arguments.no_record:
        values["record"] = False
    name = values.get("task")
    if isinstance(name, str):
        values["task"] = msgspec.to_builtins(load_task(name).spec)
    if "task" not in values:
        raise ConfigError("nothing to learn was named: give --task keylock, or FILE:FUNCTION")
    config = checked(values)
    resolve(config.learner)
    if arguments.warm_start is not None:
        prior = prior_of(Path(arguments.warm_start), config.task, config.learner)
        config = msgspec.structs.replace(config, warm_start=prior)
    typed = name if isinstance(name, str) else config.task.name
    return Asked(
        config=config,
        run_dir=Path(arguments.out or _default_out(config.task.name)),
        own_task=typed if ":" in typed else None,
    )


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text())
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error.strerror}: correct its name") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not TOML: {error}") from None


def _default_out(task: str) -> str:
    """Return ``runs/TASK-TIME``, a name that can also stand in a key."""
    plain = re.sub(r"[^A-Za-z0-9_-]+", "-", task).strip("-") or "run"
    return f"runs/{plain[:40]}-{time.strftime('%Y%m%d-%H%M%S')}"
