"""The head of a record: what was asked for, taken from the run folder's ``run.toml``.

Only the parameter space is understood here; the rest of the text is kept as it stands.
"""

from __future__ import annotations

import time
import tomllib
from pathlib import Path

from shearline.record.topics import RunConfig


def config_of(run: str, run_dir: Path) -> RunConfig:
    """Return the head of a record from the run folder's ``run.toml``, empty where there is none."""
    path = run_dir / "run.toml"
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    space = _space(text)
    return RunConfig(
        run=run,
        text=text,
        names=list(space),
        units=[unit for unit, _, _ in space.values()],
        low=[low for _, low, _ in space.values()],
        high=[high for _, _, high in space.values()],
        at_s=time.time(),
    )


def _space(text: str) -> dict[str, tuple[str, float, float]]:
    task = tomllib.loads(text).get("task", {}) if text else {}
    space = task.get("space", {}) if isinstance(task, dict) else {}
    return {name: (str(unit), float(low), float(high)) for name, (unit, low, high) in space.items()}
