"""What a trial on the arm comes to: cost and verdict by the functions of the simulated one."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shearline.evaluator.keylock_spec import COST_PER_M, DEPTH_M, SKILL_VERSION
from shearline.evaluator.keylock_variation import level
from shearline.evaluator.local import trace_data
from shearline.evaluator.robot import log as logs
from shearline.evaluator.robot.bounds import Bounds
from shearline.evaluator.robot.port import Array
from shearline.evaluator.robot.trial import Report
from shearline.evaluator.skill import semantic
from shearline.evaluator.skill.parameters import Parameters, parameters
from shearline.evaluator.skill.semantic import Limits
from shearline.protocol.messages import JUDGED, OutcomeKind, Result, TraceData, Trial, clip

#: Joints of the arm that the task's own torque limits are for.
_TASK_JOINTS = 7


@dataclass(frozen=True, slots=True)
class Task:
    """The key-in-lock at one level, as a robot runs it."""

    name: str = "keylock"
    skill: int = SKILL_VERSION

    def work(self, theta: Array, bounds: Bounds, joints: int) -> tuple[Parameters, Limits]:
        """Return the named tuple and what fails a trial: the task's limits, or the lab's if lower.

        The task's torques are those of an arm of seven joints; for others the lab's count alone.
        """
        torque = np.array(bounds.guard.tau_ext_nm)
        if joints == _TASK_JOINTS:
            chosen = level(self.name)
            torque = np.minimum(torque, [chosen.torque_big] * 4 + [chosen.torque_small] * 3)
        limits = Limits(torque, bounds.guard.roi_m, DEPTH_M, COST_PER_M)
        return parameters(theta), limits

    def verdict(self, report: Report) -> str:
        """Name how a trial ended."""
        return semantic.VERDICTS[report.end.verdict] or "success"

    def cost(self, report: Report, bounds: Bounds) -> float:
        """Return eq. (6) of the paper for a trial with a verdict."""
        limits = Limits(np.zeros(1), bounds.guard.roi_m, DEPTH_M, COST_PER_M)
        tick_s = 1.0 / bounds.contact.reference_hz
        return float(semantic.cost(report.end, limits, tick_s))


@dataclass(frozen=True, slots=True)
class Cell:
    """What all trials of one session share.

    Attributes:
        joints: Of the robot.
        engine: Fingerprint of robot, bounds and skill.
        o_t_lock: Believed pose of the lock ``(4, 4)``.
    """

    task: Task
    bounds: Bounds
    joints: int
    engine: str
    o_t_lock: Array


@dataclass(frozen=True, slots=True)
class Ran:
    """How one attempt went.

    Attributes:
        why: Why there is no verdict, or ``""``.
        log: The robot's ``(rows, columns)``.
        wall_s: How long it took [s].
    """

    kind: OutcomeKind
    why: str = ""
    report: Report = field(default_factory=Report)
    log: Array = field(default_factory=lambda: np.zeros((0, 1)))
    wall_s: float = 0.0

    @property
    def is_judged(self) -> bool:
        """Whether there is a verdict, and thus a cost."""
        return self.kind in JUDGED


def result_of(trial: Trial, ran: Ran, cell: Cell) -> tuple[Result, TraceData | None]:
    """Return an attempt's result and its trace.

    Extras of a trial with a verdict: ``depth_m``, ``insertion_s``, ``trial_s`` as in simulation;
    ``clipped``, the share of ticks in which the skill asked for more force, torque or speed of its
    reference than the lab lets through; ``late_ticks``, ticks made up for.
    """
    report, log = ran.report, ran.log
    if not ran.is_judged:
        return _result(trial, ran, cell, 0.0, {}), None
    extras = {
        "depth_m": float(report.end.depth_m),
        "insertion_s": max(report.end.clock_ticks, 0) / cell.bounds.contact.reference_hz,
        "trial_s": float(log[-1, 0] - log[0, 0]) if len(log) else 0.0,
        "clipped": report.clipped,
        "late_ticks": float(report.late),
    }
    result = _result(trial, ran, cell, cell.task.cost(report, cell.bounds), extras)
    shown = logs.trace(log, cell.joints, report, cell.o_t_lock)
    return result, None if shown is None else trace_data(shown, trial.trial, trial.token)


def _result(trial: Trial, ran: Ran, cell: Cell, cost: float, extras: dict[str, float]) -> Result:
    why = semantic.VERDICTS[ran.report.end.verdict] if ran.is_judged else ran.why
    return Result(
        boot=trial.boot,
        token=trial.token,
        trial=trial.trial,
        kind=ran.kind,
        cost=cost,
        seed=trial.seed,
        engine=clip(cell.engine),
        digest=logs.digest(ran.log) if ran.is_judged else "",
        wall_s=ran.wall_s,
        why=clip(why),
        extras=extras,
    )
