"""The same tuples in the simulation and through a robot's path: ``python -m emulator.compare``.

Both have the same arm, lock and pins, and the lock where it is believed to be. What differs is the
control layer and everything beyond it: the client library's impedance controller instead of the
simulation's, references at 200 Hz, the robot's own estimate of forces, its log's clock.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from emulator.kit import FR3, PANDA, Kind, tool
from emulator.process import Emulator

from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.keylock_draw import draw_setup
from shearline.evaluator.keylock_variation import level
from shearline.evaluator.robot.bounds import Bounds, read_bounds
from shearline.evaluator.robot.errors import MotionEnded
from shearline.evaluator.robot.frames import pose
from shearline.evaluator.robot.ladder import extract
from shearline.evaluator.robot.port import Array
from shearline.evaluator.robot.results import Task
from shearline.evaluator.robot.trial import Insertion, Report, Work, to_start
from shearline.evaluator.robot.watch import Watch
from shearline.evaluator.skill import semantic
from shearline.evaluator.skill.baselines import latin_hypercube
from shearline.evaluator.skill.parameters import BOUNDS, space
from shearline.evaluator.skill.semantic import Decision
from shearline.evaluator.skill.trace import COLUMNS
from shearline.sims.plant import Setup
from shearline.sims.scene import TICK_S, believed_lock_pose

LAB = Path(__file__).parents[2] / "docs" / "examples" / "lab.toml"

#: Spread of the tuples around a good one, as a share of each parameter's range.
SPREAD = 0.1

#: A machine may be so many times as crowded as a lab's before a robot's clock counts as standing.
PATIENCE = 40.0

#: A trial that ends without a verdict is run so often in all.
TRIES = 3

#: As fast as this machine goes.
UNCAPPED = 1000.0


_FORCE = [i for i, (name, _) in enumerate(COLUMNS) if name.startswith("wrench.f")]


@dataclass(frozen=True, slots=True)
class Verdict:
    """How one trial ended.

    Attributes:
        name: ``success``, a failure's name, or why there is no verdict.
        cost: Eq. (6) of the paper [s]; NaN without a verdict.
        depth_m: Depth of the tip at the end [m].
        insertion_s: Time since the mouth plane [s].
        force_n: Largest force on the tip, low-passed; NaN through the robot's path.
    """

    name: str
    cost: float
    depth_m: float
    insertion_s: float
    force_n: float = np.nan


@dataclass(frozen=True, slots=True)
class Pair:
    """One tuple in both, and in a simulation with the lock moved as from trial to trial."""

    theta: Array
    simulated: Verdict
    moved: Verdict
    robot: Verdict
    clipped: float = 0.0

    @property
    def agrees(self) -> bool:
        """Whether both came to the same verdict."""
        return self.simulated.name == self.robot.name

    @property
    def keeps(self) -> bool:
        """Whether the simulation comes to the same verdict with the lock moved."""
        return self.simulated.name == self.moved.name

    @property
    def dearer(self) -> float:
        """How much more the robot's path cost [s]."""
        return self.robot.cost - self.simulated.cost


def tuples(lab: Bounds, count: int, seed: int = 0) -> Array:
    """Draw tuples ``(count, 23)`` the lab allows: half all over, half around its canary.

    The first half is a Latin hypercube of the lab's ranges.
    """
    wide = count // 2
    low, high = np.array([lab.range_of(name) for name in BOUNDS]).T
    everywhere = low + (high - low) * space().normalise(latin_hypercube(wide, seed))
    chance = np.random.default_rng(seed).standard_normal((count - wide, len(BOUNDS)))
    around = np.clip(lab.canary_tuple() + SPREAD * (high - low) * chance, low, high)
    return np.concatenate([everywhere, around])


def simulate(task: KeylockTask, theta: Array, setup: Setup) -> Verdict:
    """Run a tuple in the simulation."""
    job = task.job(theta)
    end, rows = task.execute(setup, job, lambda: None)
    force_n = float(np.linalg.norm(rows[:, _FORCE], axis=1).max())
    cost = semantic.cost(end, job.limits, TICK_S)
    return replace(_verdict(end, cost, TICK_S), force_n=force_n)


def insert(
    kind: Kind, robot: Emulator, theta: Array, lab: Bounds, place: str = "place"
) -> tuple[Report, Array]:
    """Run a tuple through a robot's real client and pull the key out again; return the log too.

    Raises:
        MotionEnded: If there is no verdict.
    """
    robot.order(place)
    robot.order(f"pace lockstep {UNCAPPED}")
    believed = believed_lock_pose()
    p, limits = Task().work(theta, lab, joints=7)
    work = Work(p, limits, pose(believed.position, believed.rotation), lab)
    port = kind.led(robot.address)
    port.open(tool())
    try:
        port.set_guard(lab.port_guard())
        watch, report = Watch(port, wall_s=_patient_s), Report()
        to_start(port, watch, work)
        insertion = Insertion(port, watch, work, report)
        insertion.approach()
        insertion.insert()
        extract(port, watch, work, report)
        return report, port.drain_log()
    finally:
        port.close()


def compare(kind: Kind, robot: Emulator, thetas: Array, lab: Bounds) -> Iterator[Pair]:
    """Run tuples ``(n, 23)`` in both."""
    task, tick_s = KeylockTask(), 1.0 / lab.contact.reference_hz
    for seed, theta in enumerate(thetas):
        simulated = simulate(task, theta, Setup())
        moved = simulate(task, theta, draw_setup(level("keylock"), seed)[0])
        try:
            report, _ = _judged(kind, robot, theta, lab)
        except MotionEnded as ended:
            yield Pair(theta, simulated, moved, Verdict(str(ended), np.nan, np.nan, np.nan))
            continue
        ran = _verdict(report.end, Task().cost(report, lab), tick_s)
        yield Pair(theta, simulated, moved, ran, report.clipped)


def _judged(kind: Kind, robot: Emulator, theta: Array, lab: Bounds) -> tuple[Report, Array]:
    """Run a tuple through a robot, again if this machine was too slow for a verdict."""
    for _ in range(TRIES - 1):
        with contextlib.suppress(MotionEnded):
            return insert(kind, robot, theta, lab)
    return insert(kind, robot, theta, lab)


def summary(pairs: Iterable[Pair]) -> str:
    """Say how far the two agree."""
    pairs = list(pairs)
    judged = [pair for pair in pairs if np.isfinite(pair.robot.cost)]
    both = [p for p in judged if p.agrees and p.simulated.name == "success"]
    agree, keep = sum(pair.agrees for pair in pairs), sum(pair.keeps for pair in pairs)
    lines = [f"{agree} of {len(pairs)} verdicts agree; {keep} stay when the simulated lock moves"]
    counts = Counter((pair.simulated.name, pair.robot.name[:40]) for pair in pairs)
    lines += [f"  {n:3d}  {one} -> {other}" for (one, other), n in sorted(counts.items())]
    for what, some in (("all with a verdict", judged), ("both succeed", both)):
        if some:
            low, middle, high = np.quantile([pair.dearer for pair in some], (0.05, 0.5, 0.95))
            lines.append(
                f"cost through the robot's path less the simulation's, {what} ({len(some)}):"
                f" median {middle:+.2f} s, 5 to 95 % {low:+.2f} to {high:+.2f} s"
            )
    return "\n".join(lines)


def _patient_s() -> float:
    """A clock by which a crowded machine keeps nobody waiting for long [s]."""
    return time.monotonic() / PATIENCE


def _verdict(end: Decision, cost: float, tick_s: float) -> Verdict:
    name = semantic.VERDICTS[end.verdict] or "success"
    return Verdict(name, float(cost), float(end.depth_m), max(end.clock_ticks, 0) * tick_s)


def _line(number: int, pair: Pair) -> str:
    ran = (pair.simulated, pair.moved, pair.robot)
    columns = [f"{v.name[:40]:8s} {v.cost:6.2f} {v.depth_m * 1e3:6.1f}" for v in ran]
    notes = f"{pair.clipped:.2f}  {pair.simulated.force_n:3.0f} N"
    return "  ".join([f"{number:3d}", *columns, notes])


def main() -> None:
    """Print one line for each tuple and how far the two agree."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", choices=("fr3", "panda"), default="fr3")
    parser.add_argument("--tuples", type=int, default=50)
    asked = parser.parse_args()
    kind = {"fr3": FR3, "panda": PANDA}[asked.robot]
    lab, pairs = read_bounds(LAB), []
    say = sys.stdout.write
    say("     simulation: cost s, depth mm; with the lock moved; robot; clipped; simulated force\n")
    with tempfile.TemporaryDirectory() as folder, Emulator(kind.version, Path(folder, "log")) as it:
        for number, pair in enumerate(compare(kind, it, tuples(lab, asked.tuples), lab)):
            pairs.append(pair)
            say(f"{_line(number, pair)}\n")
            sys.stdout.flush()
    say(f"{summary(pairs)}\n")


if __name__ == "__main__":
    main()
