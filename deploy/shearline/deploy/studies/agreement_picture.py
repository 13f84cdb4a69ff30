"""The picture of how far the engines agree: insertion force, slip, costs of the same tuples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from shearline.evaluator.agreement.compare import ENGINES, Findings
from shearline.evaluator.agreement.scenes import DEPTHS_M

_COLOURS = ("#1f4e79", "#c55a11")


def draw(found: Findings, path: Path) -> None:
    """Draw three panels into a PNG."""
    figure = Figure(figsize=(13.0, 3.8), layout="constrained")
    force, slip, cost = figure.subplots(1, 3)
    for engine, colour, values, curve in zip(
        ENGINES, _COLOURS, found.force, found.slip, strict=True
    ):
        force.plot(DEPTHS_M * 1e3, values, color=colour, label=engine)
        slip.plot(curve[:, 0], curve[:, 1] * 1e6, color=colour, label=engine)
    force.set(xlabel="depth [mm]", ylabel="force of the lock [N]", title="slow insertion")
    slip.axvline(0.25, color="0.6", linewidth=0.8)
    slip.set(
        xlabel="pull / push", ylabel="tip moved [um]", ylim=(-5.0, 100.0), xlim=(0.0, 0.32),
        title="slip along the face, friction .25",
    )  # fmt: skip
    _costs(cost, found)
    for axis in (force, slip):
        axis.legend(frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)


def _costs(axis: Any, found: Findings) -> None:
    costs = np.array([one.cost for one in found.tried])
    same = np.array([one.success[0] == one.success[1] for one in found.tried])
    for mask, colour, label in ((same, "0.45", "same"), (~same, "#b00020", "other")):
        axis.plot(*costs[mask].T, "o", color=colour, markersize=4, label=f"{label} verdict")
    most = float(costs.max()) * 1.05
    axis.plot([0.0, most], [0.0, most], color="0.8", linewidth=0.8, zorder=0)
    axis.set(xlabel=f"cost in {ENGINES[0]} [s]", ylabel=f"cost in {ENGINES[1]} [s]")
    axis.set_title(f"{len(found.tried)} random tuples")
    axis.legend(frameon=False)
