"""What the lab allows: one TOML file that belongs to the people beside the robot.

Nobody else widens it: not the learner, not a message, not an option of the command line. The file
is read once, checked against itself and against ceilings that no file can lift, and hashed; the
hash is part of the engine that every result names. A tuple outside of it is rejected as it is:
nothing is ever clamped into range.
"""

from __future__ import annotations

import hashlib
import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec
import numpy as np
from msgspec import Meta

from shearline.evaluator.keylock_spec import ROI_M
from shearline.evaluator.robot.errors import BoundsError
from shearline.evaluator.robot.port import Array, Guard, Tool
from shearline.evaluator.skill.parameters import BOUNDS

#: No file allows more. The speed is that of manual operation in ISO 10218-1 (reduced speed). The
#: force is along each axis of the lock; with all three at once, 69 N, it is half of the 140 N that
#: ISO/TS 15066 gives for a hand.
SPEED_MAX_MPS = 0.25
FORCE_MAX_N = 40.0
TORQUE_MAX_NM = 12.0
TRIAL_MAX_S = 60.0

Positive = Annotated[float, Meta(gt=0.0)]
Triple = tuple[float, float, float]
Name = Annotated[str, Meta(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_.-]+$")]
S = TypeVar("S", bound=msgspec.Struct)


class _Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of the file's tables: what is not known is a mistake, not a remark."""


class ToolTable(_Table, frozen=True, kw_only=True):
    """What hangs on the flange; lengths in m, the turn as roll, pitch and yaw [rad]."""

    flange_to_tip_m: Triple = (0.0, 0.0, 0.1414)
    flange_to_tip_rad: Triple = (0.0, 0.0, 0.0)
    mass_kg: Annotated[float, Meta(ge=0.0, le=5.0)] = 0.75
    centre_m: Triple = (0.0, 0.0, 0.06)


class ContactTable(_Table, frozen=True, kw_only=True):
    """How hard and how fast the arm may push: stiffness, clip, force, references, time.

    Force and torque are those along, and about, each axis of the lock.
    """

    stiffness_max_npm: Positive = 2000.0
    stiffness_max_nmprad: Positive = 200.0
    clip_m: Positive = 0.02
    clip_rad: Positive = 0.05
    force_max_n: Positive = FORCE_MAX_N
    torque_max_nm: Positive = TORQUE_MAX_NM
    reference_mps: Positive = 0.2
    reference_radps: Positive = 1.0
    reference_hz: Annotated[float, Meta(ge=100.0, le=200.0)] = 200.0
    trial_s: Positive = 20.0


class GuardTable(_Table, frozen=True, kw_only=True):
    """Where the arm stops whatever the skill wants."""

    tau_ext_nm: Annotated[tuple[Positive, ...], Meta(min_length=1, max_length=16)]
    force_n: Positive = 60.0
    torque_nm: Positive = 15.0
    speed_mps: Positive = SPEED_MAX_MPS
    lowest_m: Triple
    highest_m: Triple
    roi_m: Annotated[float, Meta(gt=0.0, le=ROI_M)] = ROI_M


class StartTable(_Table, frozen=True, kw_only=True):
    """Where a trial starts: so far in front of the mouth, found there within the tolerance."""

    gap_m: Annotated[float, Meta(ge=0.005, le=0.1)] = 0.015
    hover_m: Annotated[float, Meta(ge=0.04, le=0.2)] = 0.05  # deeper than any trial goes
    tolerance_m: Positive = 1e-3
    tolerance_rad: Positive = math.radians(1.0)
    speed_mps: Positive = 0.1


class LockTable(_Table, frozen=True, kw_only=True):
    """The lock on the table: how deep the tip is when the key sits in it by hand."""

    seated_m: Annotated[float, Meta(gt=0.005, le=0.1)] = 0.025


class WearTable(_Table, frozen=True, kw_only=True):
    """Which key and lock these are, and after how many insertions each is worn."""

    key: Name = "key-1"
    lock: Name = "lock-1"
    key_insertions: Annotated[int, Meta(ge=1)] = 5000
    lock_insertions: Annotated[int, Meta(ge=1)] = 20000


class CanaryTable(_Table, frozen=True, kw_only=True):
    """A parameter set known to work, tried now and then; what it leaves out is mid-range."""

    every: Annotated[int, Meta(ge=1, le=1000)] = 50
    theta: dict[str, float] = {}


class Bounds(_Table, frozen=True, kw_only=True):
    """The whole file.

    Attributes:
        ranges: Parameter name to its narrower range here; the others keep the task's.
        link_loss: What becomes of a running trial when the learner cannot be reached: ``"finish"``
            it within its time, or ``"stop"`` it.
    """

    guard: GuardTable
    tool: ToolTable = ToolTable()
    contact: ContactTable = ContactTable()
    start: StartTable = StartTable()
    lock: LockTable = LockTable()
    wear: WearTable = WearTable()
    canary: CanaryTable = CanaryTable()
    ranges: dict[str, tuple[float, float]] = {}
    link_loss: Literal["finish", "stop"] = "finish"

    @property
    def hash(self) -> str:
        """12 hexadecimal digits that change with any value, and not with comments."""
        values = msgspec.json.encode(msgspec.to_builtins(self), order="sorted")
        return hashlib.sha256(values).hexdigest()[:12]

    def range_of(self, name: str) -> tuple[float, float]:
        """Return the lowest and highest value of a parameter here."""
        _, low, high = BOUNDS[name]
        return self.ranges.get(name, (low, high))

    def canary_tuple(self) -> Array:
        """Return the canary's tuple ``(23,)``."""
        middle = {name: sum(self.range_of(name)) / 2.0 for name in BOUNDS}
        return np.array(list((middle | self.canary.theta).values()))

    def objection(self, theta: Array) -> str:
        """Return why a tuple may not be tried on this robot, or ``""``."""
        if theta.shape != (len(BOUNDS),):
            return f"expected {len(BOUNDS)} parameters, got shape {theta.shape}"
        for name, value in zip(BOUNDS, theta.tolist(), strict=True):
            low, high = self.range_of(name)
            if not low <= value <= high:  # also NaN
                unit = BOUNDS[name][0]
                return f"{name} = {value:g} {unit} is outside this lab's [{low:g}, {high:g}]"
        return ""

    def port_guard(self) -> Guard:
        """Return what the port keeps to."""
        g = self.guard
        return Guard(
            tau_ext_max=np.array(g.tau_ext_nm),
            force_max_n=g.force_n,
            torque_max_nm=g.torque_nm,
            speed_max_mps=g.speed_mps,
            box_m=np.array([g.lowest_m, g.highest_m]),
            push_max_n=self.contact.force_max_n,
            twist_max_nm=self.contact.torque_max_nm,
        )

    def port_tool(self) -> Tool:
        """Return what hangs on the flange."""
        from shearline.evaluator.robot.frames import rpy  # noqa: PLC0415 - needs no bounds

        pose = np.eye(4)
        pose[:3, :3] = rpy(self.tool.flange_to_tip_rad)
        pose[:3, 3] = self.tool.flange_to_tip_m
        return Tool(pose, self.tool.mass_kg, np.array(self.tool.centre_m))


def read_bounds(path: Path) -> Bounds:
    """Read and check the lab's file.

    Raises:
        BoundsError: If it is missing, malformed, inconsistent, or wider than the ceilings.
    """
    try:
        text = path.read_text()
    except FileNotFoundError:
        raise BoundsError(
            f"there is no bounds file {path}: copy docs/examples/lab.toml and put your numbers in"
        ) from None
    except OSError as fault:
        raise BoundsError(f"the bounds file {path} cannot be read: {fault.strerror}") from None
    except UnicodeDecodeError:
        raise BoundsError(f"the bounds file {path} is no text: expected TOML") from None
    try:
        return parse_bounds(text)
    except BoundsError as fault:
        raise BoundsError(f"{path}: {fault}: correct the file") from None


def parse_bounds(text: str) -> Bounds:
    """Read the text of a bounds file.

    Raises:
        BoundsError: As :func:`read_bounds`.
    """
    try:
        values: dict[str, Any] = tomllib.loads(text)
        bounds = msgspec.convert(values, Bounds)
    except tomllib.TOMLDecodeError as fault:
        raise BoundsError(f"expected TOML, got {fault}") from None
    except msgspec.ValidationError as fault:
        raise BoundsError(str(fault)[:1].lower() + str(fault)[1:]) from None
    _check_finite(values)
    for name in (*bounds.ranges, *bounds.canary.theta):
        if name not in BOUNDS:
            raise BoundsError(f"the skill has no parameter {name!r}: it has {', '.join(BOUNDS)}")
    _check_ceilings(bounds)
    _check_ranges(bounds)
    _check_contact(bounds)
    if why := bounds.objection(bounds.canary_tuple()):
        raise BoundsError(f"the canary's {why}")
    return bounds


def _check_finite(values: object, where: str = "$") -> None:
    """TOML has nan and inf; limits do not."""
    if isinstance(values, Mapping):
        for key, value in values.items():
            _check_finite(value, f"{where}.{key}")
    elif isinstance(values, list):
        for value in values:
            _check_finite(value, where)
    elif isinstance(values, float) and not math.isfinite(values):
        raise BoundsError(f"expected a finite number at {where}, got {values}")


def _check_ceilings(bounds: Bounds) -> None:
    ceilings = (
        ("guard.speed_mps", bounds.guard.speed_mps, SPEED_MAX_MPS, "m/s"),
        ("start.speed_mps", bounds.start.speed_mps, bounds.guard.speed_mps, "m/s"),
        ("contact.reference_mps", bounds.contact.reference_mps, SPEED_MAX_MPS, "m/s"),
        ("contact.force_max_n", bounds.contact.force_max_n, FORCE_MAX_N, "N"),
        ("contact.torque_max_nm", bounds.contact.torque_max_nm, TORQUE_MAX_NM, "N m"),
        ("contact.trial_s", bounds.contact.trial_s, TRIAL_MAX_S, "s"),
        ("guard.force_n", bounds.guard.force_n, 2.0 * FORCE_MAX_N, "N"),
        ("guard.torque_nm", bounds.guard.torque_nm, 2.0 * TORQUE_MAX_NM, "N m"),
    )
    for name, value, ceiling, unit in ceilings:
        if value > ceiling:
            raise BoundsError(f"{name} = {value:g} {unit} is above the ceiling of {ceiling:g}")


def _check_ranges(bounds: Bounds) -> None:
    for name, (low, high) in bounds.ranges.items():
        unit, lowest, highest = BOUNDS[name]
        if not lowest <= low < high <= highest:
            raise BoundsError(
                f"ranges.{name} = [{low:g}, {high:g}] {unit} is not a range within the task's"
                f" [{lowest:g}, {highest:g}]"
            )
    low_m, high_m = bounds.guard.lowest_m, bounds.guard.highest_m
    if not all(low < high for low, high in zip(low_m, high_m, strict=True)):
        raise BoundsError(f"guard.lowest_m {low_m} is not below guard.highest_m {high_m}")


def _check_contact(bounds: Bounds) -> None:
    """K clip <= F_max along each axis, with every stiffness the skill may ask for."""
    from shearline.evaluator.skill.manipulation import AXIAL_K  # noqa: PLC0415 - loads a compiler

    c = bounds.contact
    for k, clip, most, what in (
        (c.stiffness_max_npm, c.clip_m, c.force_max_n, "stiffness_max_npm * clip_m"),
        (c.stiffness_max_nmprad, c.clip_rad, c.torque_max_nm, "stiffness_max_nmprad * clip_rad"),
    ):
        if k * clip > most * (1.0 + 1e-9):
            raise BoundsError(
                f"contact.{what} = {k * clip:g} is more than the {most:g} that contact allows along"
                " each axis"
            )
    for name in ("con_k_xy", "ins_k_xy"):
        if (k := bounds.range_of(name)[1]) > c.stiffness_max_npm:
            raise BoundsError(
                f"{name} may be {k:g} N/m but contact.stiffness_max_npm is"
                f" {c.stiffness_max_npm:g}: narrow ranges.{name} or allow it"
            )
    if (k := bounds.range_of("ins_k_rot")[1]) > c.stiffness_max_nmprad:
        raise BoundsError(
            f"ins_k_rot may be {k:g} N m/rad but contact.stiffness_max_nmprad is"
            f" {c.stiffness_max_nmprad:g}: narrow ranges.ins_k_rot or allow it"
        )
    if c.stiffness_max_npm < AXIAL_K:
        raise BoundsError(
            f"contact.stiffness_max_npm = {c.stiffness_max_npm:g} is below the"
            f" {AXIAL_K:g} N/m with which the skill pushes and pulls along the axis"
        )
