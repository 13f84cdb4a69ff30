"""MuJoCo and PyBullet side by side: what each found, how far apart, and how far they may be."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from shearline.evaluator.agreement import analytic, scenes
from shearline.evaluator.base import Array
from shearline.evaluator.keylock import BulletKeylockTask, KeylockTask
from shearline.sims.plant import Plant

ENGINES = ("mujoco", "pybullet")

#: Pushes against the face [N]; less does not reach it within the time.
PUSHES_N = (5.0, 10.0, 20.0)

#: Pulls along the face, from x towards y [rad].
DIRECTIONS_RAD = (0.0, math.pi / 4.0, math.pi / 2.0)


@dataclass(frozen=True, slots=True)
class Row:
    """One comparison.

    Attributes:
        what: In words.
        unit: Of the values; ``""`` for a share.
        mujoco: What it found.
        pybullet: What it found.
        expected: What mechanics says, or ``None``.
        difference: Between the two, in the unit of ``limit``; against ``expected`` the larger one.
        limit: Most that is allowed.
    """

    what: str
    unit: str
    mujoco: float
    pybullet: float
    expected: float | None
    difference: float
    limit: float

    @property
    def agrees(self) -> bool:
        """Whether the difference is within the limit."""
        return self.difference <= self.limit


@dataclass(frozen=True, slots=True)
class Tried:
    """Verdict and cost of one tuple on both engines, MuJoCo first."""

    seed: int
    success: tuple[bool, bool]
    cost: tuple[float, float]


@dataclass(slots=True)
class Findings:
    """Rows, and the curves behind them.

    Attributes:
        rows: In the order of the docs.
        force: Of the lock at :data:`~.scenes.DEPTHS_M`, for each engine ``(depths,)`` [N].
        slip: How far the tip has moved over pull over push, for each engine ``(n, 2)``.
        tried: The tuples.
    """

    rows: list[Row] = field(default_factory=list)
    force: list[Array] = field(default_factory=list)
    slip: list[Array] = field(default_factory=list)
    tried: list[Tried] = field(default_factory=list)


def compare(tuples: int, motions: int, found: Findings, task: str = "keylock") -> Iterator[Row]:
    """Compare the engines and yield each row as it is there.

    Args:
        tuples: Random tuples whose verdicts are compared.
        motions: Random motions through free space.
        found: Filled on the way.
        task: Level, with or without switches, on which the tuples are tried; all the rest is on
            the plain lock.

    Raises:
        ConfigError: If there is no such level or switch.
    """
    tried = (KeylockTask(task), BulletKeylockTask(task))
    yield from _kept(found, _mechanics())
    yield from _kept(found, _scenes((KeylockTask(), BulletKeylockTask()), motions, found))
    yield from _kept(found, _verdicts(tried, tuples, found))


def _kept(found: Findings, rows: Iterator[Row]) -> Iterator[Row]:
    for row in rows:
        found.rows.append(row)
        yield row


def _mechanics() -> Iterator[Row]:
    """Compare both engines with closed forms."""
    for what, unit, ask, limit in (
        ("period of a pendulum let go at 1 rad", "s", analytic.pendulum, 1e-4),
        ("friction coefficient of a sliding block", "", analytic.slope, 0.01),
        ("speed of a block that another one hit", "m/s", analytic.impact, 0.5),
    ):
        (ours, expected), (theirs, _) = (ask(engine) for engine in ENGINES)
        off = max(abs(value / expected - 1.0) for value in (ours, theirs))
        yield Row(what, unit, ours, theirs, expected, off, limit)


def _scenes(
    tasks: tuple[KeylockTask, BulletKeylockTask], motions: int, found: Findings
) -> Iterator[Row]:
    plants = (tasks[0].plant, tasks[1].plant)
    yield _free_space(plants, motions)
    for push in PUSHES_N:
        felt = [scenes.against_the_face(plant, push) for plant in plants]
        off = max(abs(force / push - 1.0) for force in felt)
        yield Row(f"force of the face against {push:g} N", "N", felt[0], felt[1], push, off, 0.01)
    for direction in DIRECTIONS_RAD:
        onsets, curves = zip(
            *(scenes.along_the_face(plant, direction) for plant in plants), strict=True
        )
        found.slip = found.slip or list(curves)
        mu = tasks[0].plant.scene.lock.friction
        off = max(abs(onset / mu - 1.0) for onset in onsets)
        what = f"pull over push at which the tip slips, {math.degrees(direction):.0f} degrees"
        yield Row(what, "", onsets[0], onsets[1], mu, off, 0.05)
    found.force = [scenes.into_the_lock(task) for task in tasks]
    ours, theirs = found.force
    sizes = [float(np.sqrt(np.mean(force**2))) for force in found.force]
    off = float(np.sqrt(np.mean((ours - theirs) ** 2))) / sizes[0]
    yield Row("force of a slow insertion, rms over depth", "N", sizes[0], sizes[1], None, off, 0.2)


def _free_space(plants: tuple[Plant, Plant], motions: int) -> Row:
    squares, far = [], [0.0, 0.0]
    for seed in range(motions):
        ours, theirs = (scenes.through_free_space(plant, seed) for plant in plants)
        squares.append(np.sum((ours - theirs) ** 2, axis=1))
        for i, tip in enumerate((ours, theirs)):
            far[i] = max(far[i], float(np.ptp(tip, axis=0).max()))
    rms_m = float(np.sqrt(np.mean(squares)))
    what = "way of the tip through free space (difference: rms)"
    return Row(what, "m", far[0], far[1], None, rms_m, 1e-4)


def _verdicts(
    tasks: tuple[KeylockTask, BulletKeylockTask], tuples: int, found: Findings
) -> Iterator[Row]:
    for seed in range(tuples):
        (ours, ours_cost), (theirs, theirs_cost) = (scenes.verdict(task, seed) for task in tasks)
        found.tried.append(Tried(seed, (ours, theirs), (ours_cost, theirs_cost)))
    rates = np.mean([tried.success for tried in found.tried], axis=0)
    other = float(np.mean([tried.success[0] != tried.success[1] for tried in found.tried]))
    name = tasks[0].spec.name
    what = f"success of {tuples} random tuples on {name} (difference: other verdicts)"
    yield Row(what, "", float(rates[0]), float(rates[1]), None, other, 0.15)
