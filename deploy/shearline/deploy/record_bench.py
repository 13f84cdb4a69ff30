"""What recording costs a key-lock run: the same run with and without, in turns.

Without means no recorder, no copies of messages and no traces at all. Wall time is that between a
run's first outcome and its last, so that starting processes does not count; processor time is that
of all of its processes, started and ended, and stays telling on a machine that has other work.
"""

from __future__ import annotations

import resource
import statistics
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from shearline.deploy import processes
from shearline.deploy.lead import outcomes
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import ShearlineError
from shearline.protocol.messages import Counted

#: A run of this many trials takes well over ten seconds, and its end less than one.
TRIALS = 100
#: Two processes that compute fill the two cores that the promise is about.
EVALUATORS = 2
#: A run that takes longer hangs [s].
RUN_S = 1200.0


@dataclass(frozen=True, slots=True)
class Figures:
    """One run.

    Attributes:
        wall_s: From its first outcome to its last [s].
        cpu_s: Of all its processes [s].
        step_cpu_ms: Processor time of the learner's owner thread within which 99 % of its steps
            stayed [ms].
        record_bytes: Size of its record.
    """

    wall_s: float
    cpu_s: float
    step_cpu_ms: float
    record_bytes: int


def measure(
    rounds: int, *, trials: int = TRIALS, say: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """Return what recording costs, from ``rounds`` of one run with and one without.

    Returns:
        ``wall_ratio`` and ``cpu_ratio`` (with over without, median of the rounds), both steps of
        the owner thread, the size of a trial on record, and all single figures.
    """
    pairs: list[tuple[Figures, Figures]] = []
    for number in range(rounds):
        # who goes first alternates: a machine that warms up or cools down favours nobody
        order = (True, False) if number % 2 == 0 else (False, True)
        found = {recorded: run_once(trials, seed=number, recorded=recorded) for recorded in order}
        pairs.append((found[True], found[False]))
        say(
            f"round {number + 1} of {rounds}: wall {found[True].wall_s:.2f} s with,"
            f" {found[False].wall_s:.2f} s without; processor {found[True].cpu_s:.2f} s with,"
            f" {found[False].cpu_s:.2f} s without"
        )
    return summed_up(pairs, trials)


def summed_up(pairs: Sequence[tuple[Figures, Figures]], trials: int) -> dict[str, Any]:
    """Return the figures of rounds ``(with, without)``."""
    median = statistics.median
    return {
        "rounds": len(pairs),
        "trials": trials,
        "evaluators": EVALUATORS,
        "wall_ratio": median(a.wall_s / b.wall_s for a, b in pairs),
        "cpu_ratio": median(a.cpu_s / b.cpu_s for a, b in pairs),
        "step_cpu_ms_with": median(a.step_cpu_ms for a, _ in pairs),
        "step_cpu_ms_without": median(b.step_cpu_ms for _, b in pairs),
        "bytes_per_trial": median(a.record_bytes for a, _ in pairs) / trials,
        "wall_s_with": [a.wall_s for a, _ in pairs],
        "wall_s_without": [b.wall_s for _, b in pairs],
        "cpu_s_with": [a.cpu_s for a, _ in pairs],
        "cpu_s_without": [b.cpu_s for _, b in pairs],
    }


def run_once(trials: int, *, seed: int, recorded: bool) -> Figures:
    """Run the key-lock once with the learner that computes nothing, and return its figures.

    Raises:
        ShearlineError: If the run did not end well.
    """
    with tempfile.TemporaryDirectory(prefix="shearline-bench-") as folder:
        run_dir = Path(folder) / "run"
        before_s = _children_s()
        child = processes.spawn_command(
            "run", _arguments(run_dir, trials, seed, recorded=recorded), Path(folder) / "run.out"
        )
        try:
            ended = processes.wait([child], patience_s=RUN_S)
        finally:
            processes.end([child])
        if not ended or child.returncode:
            raise ShearlineError(f"the run in {run_dir} did not end well: nothing was measured")
        at_s = [row.at_s for row in outcomes(run_dir) if isinstance(row, Counted)]
        return Figures(
            wall_s=max(at_s) - min(at_s),
            cpu_s=_children_s() - before_s,
            step_cpu_ms=_step_cpu_ms(run_dir),
            record_bytes=sum(path.stat().st_size for path in run_dir.glob("record*.mcap")),
        )


def _arguments(run_dir: Path, trials: int, seed: int, *, recorded: bool) -> list[str]:
    words = ["up", "--task", "keylock", "--learner", "lhs", "--episodes", "1", "--json"]
    words += ["--trials", str(trials), "--evaluators", str(EVALUATORS), "--seed", str(seed)]
    words += ["--out", str(run_dir), "--listen", free_endpoint()]
    return words if recorded else [*words, "--no-record", "--no-traces"]


def _step_cpu_ms(run_dir: Path) -> float:
    summary = msgspec.json.decode((run_dir / "summary.json").read_bytes())
    return float(summary["step_cpu_ms_p99"])


def _children_s() -> float:
    """Return the processor time of all children that ended, and of theirs [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
