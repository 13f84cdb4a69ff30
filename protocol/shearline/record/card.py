"""The card of one trial: everything about its outcome as a page of text.

Markdown in, nothing else: whoever shows it decides where.
"""

from __future__ import annotations

from shearline.protocol.messages import Counted
from shearline.record.topics import RunConfig


def card(counted: Counted, config: RunConfig | None) -> str:
    """Return the card of one trial as Markdown, parameters with units and place in their range."""
    outcome = counted.kind.value if counted.kind else "lost"
    why = f" ({counted.why})" if counted.why else ""
    where = f"episode {counted.episode + 1}, on {counted.evaluator or '-'}"
    when = f"in {counted.wall_s:.2f} s, attempt {counted.attempts}, seed {counted.seed}"
    lines = [
        f"# Trial {counted.trial}: {outcome}{why}",
        "",
        f"**cost {counted.cost:.4g}**, {where}",
        f"{when}{', late' if counted.late else ''}",
        "",
        *_parameters(counted, config),
        "",
        *(f"- {name}: {value:.4g}" for name, value in sorted(counted.extras.items())),
        "",
        f"{counted.engine} {counted.digest[:16]}".strip(),
    ]
    return "\n".join(lines)


def _parameters(counted: Counted, config: RunConfig | None) -> list[str]:
    head = ["| parameter | value | unit | in its range |", "| :-- | --: | :-- | :-- |"]
    if config is None or len(config.names) != len(counted.theta):
        return [*head, *(f"| x{i} | {v:.4g} | | |" for i, v in enumerate(counted.theta))]
    rows = zip(config.names, counted.theta, config.units, config.low, config.high, strict=True)
    return [
        *head,
        *(
            f"| {name} | {value:.4g} | {unit} | {_bar((value - low) / (high - low))} |"
            for name, value, unit, low, high in rows
        ),
    ]


def _bar(share: float, cells: int = 12) -> str:
    """Return a bar of fixed width with one mark at ``share`` of it, 0 to 1."""
    at = min(cells - 1, max(0, int(share * cells)))
    return f"`{'-' * at}#{'-' * (cells - 1 - at)}`"
