"""The state diagram of the arm, as Mermaid text.

``python -m shearline.evaluator.robot.diagram`` prints it; docs/robot.md shows it.
"""

from __future__ import annotations

import sys

from shearline.evaluator.robot.states import OPERATOR, TABLE


def mermaid() -> str:
    """Return the diagram: one arrow for each pair of states, the operator's acts marked."""
    arrows: dict[tuple[str, str], list[str]] = {}
    for state, row in TABLE.items():
        for cause, after in row.items():
            said = f"{cause} (operator)" if cause in OPERATOR else str(cause)
            arrows.setdefault((state, after), []).append(said)
    return "\n".join(
        [
            "stateDiagram-v2",
            f"    [*] --> {next(iter(TABLE))}",
            *(f"    {a} --> {b}: {', '.join(causes)}" for (a, b), causes in arrows.items()),
        ]
    )


if __name__ == "__main__":  # pragma: no cover - the command itself
    sys.stdout.write(mermaid() + "\n")
