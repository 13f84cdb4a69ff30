"""Make the pictures of the documentation: the scene, one insertion cut open, its forces.

python -m shearline.evaluator.skill.pictures --out docs/images
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from shearline.evaluator.base import Array, Trace
from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.keylock_draw import draw_setup
from shearline.evaluator.keylock_variation import level
from shearline.evaluator.skill.baselines import TUPLES, tuple_of
from shearline.protocol.errors import ShearlineError
from shearline.sims import render
from shearline.sims.lock import PINS
from shearline.sims.panda import JOINTS

#: The tip's depths at which the lock is shown cut open [m].
DEPTHS_M = (-2.5e-3, 6e-3, 13e-3, 24.4e-3)

#: The trial that is shown: the centre of the box with a firm push, a lock that is .5 mm off.
SEED = 4


def main(arguments: list[str] | None = None) -> int:
    """Write the pictures and return an exit code."""
    parser = argparse.ArgumentParser(description="Make the pictures of the key-in-lock task.")
    parser.add_argument("--out", type=Path, default=Path("docs/images"), help="folder to write to")
    options = parser.parse_args(arguments)
    try:
        render.choose_backend()
        options.out.mkdir(parents=True, exist_ok=True)
        for path in pictures(options.out):
            sys.stdout.write(f"{path}\n")
    except ShearlineError as error:
        sys.stderr.write(f"{error}\n")
        return 4
    return 0


def pictures(out: Path) -> list[Path]:
    """Run one trial and write ``keylock-scene.png``, ``keylock-cut.png``, ``keylock-trial.png``."""
    task = KeylockTask()
    setup, _ = draw_setup(level("keylock"), SEED)
    outcome = task.run(tuple_of(TUPLES["centre-push"]), SEED, lambda: None)
    assert outcome.trace is not None
    scene, cut, trial = (out / f"keylock-{name}.png" for name in ("scene", "cut", "trial"))
    render.write_png(scene, render.draw_scene(task.plant, setup))
    frames = [
        render.draw_cut(task.plant, setup, _qpos_at(outcome.trace, depth)) for depth in DEPTHS_M
    ]
    render.write_png(cut, np.concatenate(frames, axis=1))
    _plot(outcome.trace, trial)
    return [scene, cut, trial]


def _qpos_at(trace: Trace, depth_m: float) -> Array:
    """Return joints and pins ``(12,)`` when the tip first was at ``depth_m``."""
    depth = trace.columns["depth"][1]
    tick = int(np.argmax(depth >= depth_m))
    names = [f"q.{j + 1}" for j in range(JOINTS)] + [f"pin.{i + 1}" for i in range(PINS)]
    return np.array([trace.columns[name][1][tick] for name in names], dtype=np.float64)


def _plot(trace: Trace, path: Path) -> None:
    """Plot depth, forces and external torques of one trial over time."""
    try:
        import matplotlib as mpl  # noqa: PLC0415 - only pictures need it

        mpl.use("Agg")
        from matplotlib import pyplot as plt  # noqa: PLC0415
    except ImportError as error:
        raise ShearlineError(
            "expected matplotlib for the plot of the trial: pip install 'shearline[plots]'"
        ) from error
    figure, axes = plt.subplots(3, 1, sharex=True, figsize=(8.0, 6.5), layout="constrained")
    _lines(axes[0], trace, [("depth", "depth of the tip", 1e3)], "mm")
    forces = [("push", "push", 1.0), ("wiggle.x", "wiggle x", 1.0), ("wiggle.y", "wiggle y", 1.0)]
    _lines(axes[1], trace, [*forces, ("wrench.fz", "lock on key, z", 1.0)], "N")
    _lines(axes[2], trace, [(f"tau_ext.{j + 1}", str(j + 1), 1.0) for j in range(JOINTS)], "N m")
    axes[2].set_xlabel("trial clock [s]")
    axes[2].set_title("external torque of each joint, low-passed", fontsize=9)
    _mark(axes, trace)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def _mark(axes: Any, trace: Trace) -> None:
    """Mark phases and the mouth plane; leave out the long approach through free space."""
    for time_s, name in trace.events:
        for axis in axes:
            axis.axvline(time_s, color="0.7", linewidth=0.8, zorder=0)
        if name in {"contact", "insertion", "mouth", "success"}:
            side = "right" if name in {"mouth", "success"} else "left"
            axes[0].text(time_s, 20.0, f" {name} ", fontsize=8, ha=side, color="0.3")
    contact_s = next(time_s for time_s, name in trace.events if name == "contact")
    axes[0].set_xlim(contact_s - 0.05, float(trace.t_s[-1]) + 0.02)


def _lines(axis: Any, trace: Trace, lines: list[tuple[str, str, float]], unit: str) -> None:
    for column, label, factor in lines:
        axis.plot(trace.t_s, trace.columns[column][1] * factor, label=label, linewidth=1.2)
    axis.set_ylabel(unit)
    axis.legend(fontsize=7, ncols=4, loc="lower right", frameon=False)


if __name__ == "__main__":
    raise SystemExit(main())
