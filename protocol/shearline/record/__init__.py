"""The run at rest: one MCAP of every message, trace and learner snapshot.

``open(run_dir)`` reads a run back; ``shearline.record.complete`` fills what a killed recorder
missed, ``shearline.record.recorder`` is the process that writes, ``shearline.record.view`` the
picture. Nothing is loaded before it is asked for: a run starts and ends with this package, and the
formats take a third of a second.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shearline.record.reader import Run, Trace
    from shearline.record.reader import open_run as open  # noqa: A004 - shearline.record.open
    from shearline.record.table import Table

__all__ = ["Run", "Table", "Trace", "open"]

_HOMES = {"Run": "reader", "Table": "table", "Trace": "reader", "open": "reader"}
_NAMES = {"open": "open_run"}


def __getattr__(name: str) -> Any:
    """Load what is asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = importlib.import_module(f"{__name__}.{_HOMES[name]}")
    return getattr(home, _NAMES.get(name, name))
