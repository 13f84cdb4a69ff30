"""``shearline doctor``: is everything here that a run needs?"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import platform
import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_json

#: Distribution and what stands still without it (``""``: nothing runs).
DISTRIBUTIONS = {
    "eclipse-zenoh": "",
    "msgspec": "",
    "numpy": "",
    "scikit-learn": "psp",
    "mujoco": "keylock",
    "numba": "keylock",
    "pybullet": "--plant pybullet",
    "mcap": "record",
    "protobuf": "record",
    "rerun-sdk": "view",
    "rich": "live table",
}
#: A wall clock that runs this much faster or slower than the monotonic one is being stepped.
CLOCK_DRIFT_MAX = 0.05
DISK_FREE_MIN_BYTES = 1 << 30


@dataclass(frozen=True, slots=True)
class Check:
    """One thing looked at: ``ok`` is ``None`` where it only limits what can be done."""

    name: str
    ok: bool | None
    found: str


def register(commands: Subparsers) -> None:
    """Add the command."""
    command = commands.add_parser("doctor", help="check versions, engine, network and clock")
    add_json(command)
    command.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> int:
    """Print every check; fail when something that every run needs is missing."""
    checks = examine()
    if arguments.json:
        print(json.dumps([asdict(check) for check in checks]))
    else:
        for check in checks:
            mark = {True: "ok", False: "FAIL", None: "note"}[check.ok]
            print(f"{mark:>4}  {check.name:<14} {check.found}")
    return Exit.RUN_FAILED if any(check.ok is False for check in checks) else Exit.OK


def examine() -> list[Check]:
    """Look at everything."""
    return [
        _python(),
        *(_distribution(name, needed_by) for name, needed_by in DISTRIBUTIONS.items()),
        _guarded("engine", _engine),
        _guarded("network", _network),
        _guarded("clock", _clock),
        Check("cores", ok=True, found=str(len(os.sched_getaffinity(0)))),
        _disk(),
    ]


def _guarded(name: str, look: Callable[[], Check]) -> Check:
    try:
        return look()
    except Exception as error:  # noqa: BLE001 - a doctor reports whatever is wrong
        return Check(name, ok=False, found=f"{type(error).__name__}: {error}")


def _python() -> Check:
    found = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    return Check("python", ok=sys.version_info >= (3, 11), found=found)


def _distribution(name: str, needed_by: str) -> Check:
    try:
        return Check(name, ok=True, found=importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        if not needed_by:
            return Check(name, ok=False, found="missing: install shearline again")
        return Check(name, ok=None, found=f"missing: no {needed_by} without it")


def _engine() -> Check:
    """Warm the key-lock up, as an evaluator would."""
    try:
        from shearline.evaluator.keylock import KeylockTask  # noqa: PLC0415 - loads the engine
    except ImportError as error:
        return Check("engine", ok=None, found=f"no key-lock here: {error}")
    start_s = time.perf_counter()
    task = KeylockTask()
    task.warm()
    return Check(
        "engine", ok=True, found=f"{task.engine}, warm {time.perf_counter() - start_s:.1f} s"
    )


def _network() -> Check:
    """Open a router and a client on this machine and send one message between them."""
    from shearline.deploy.loopback import round_trip_s  # noqa: PLC0415 - loads zenoh

    return Check(
        "network", ok=True, found=f"zenoh round trip {round_trip_s() * 1e3:.2f} ms on loopback"
    )


def _clock() -> Check:
    """Compare the wall clock with the monotonic one over a short while."""
    wall_s, monotonic_s = time.time(), time.monotonic()
    while time.monotonic() - monotonic_s < 0.05:
        pass
    drift = abs((time.time() - wall_s) / (time.monotonic() - monotonic_s) - 1.0)
    if drift > CLOCK_DRIFT_MAX:
        return Check("clock", ok=None, found="is being stepped: times on record will jump")
    return Check("clock", ok=True, found=f"steady, {time.strftime('%Y-%m-%d %H:%M:%S %Z')}")


def _disk() -> Check:
    free = shutil.disk_usage(".").free
    enough = True if free >= DISK_FREE_MIN_BYTES else None
    return Check("disk", ok=enough, found=f"{free / 2**30:.1f} GiB free here")
