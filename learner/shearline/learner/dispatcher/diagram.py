"""State diagrams of the transition tables, as Mermaid text.

``python -m shearline.learner.dispatcher.diagram`` prints them; the docs show them.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from shearline.learner.dispatcher.states import ATTEMPT, RUN, TRIAL, Table

TABLES: Mapping[str, Table[Any, Any]] = MappingProxyType(
    {"run": RUN, "trial": TRIAL, "attempt": ATTEMPT}
)


def mermaid(table: Table[Any, Any]) -> str:
    """Return the diagram of a table: first state first, one arrow for each pair of states."""
    arrows: dict[tuple[str, str], list[str]] = {}
    for state, row in table.items():
        for cause, after in row.items():
            arrows.setdefault((state, after), []).append(cause)
    return "\n".join(
        [
            "stateDiagram-v2",
            f"    [*] --> {next(iter(table))}",
            *(f"    {a} --> {b}: {', '.join(causes)}" for (a, b), causes in arrows.items()),
            *(f"    {state} --> [*]" for state, row in table.items() if not row),
        ]
    )


def main() -> None:
    """Print all of them."""
    for name, table in TABLES.items():
        sys.stdout.write(f"%% {name}\n{mermaid(table)}\n\n")


if __name__ == "__main__":  # pragma: no cover - the command itself
    main()
