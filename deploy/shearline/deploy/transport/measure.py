"""``shearline bench transport``: the full path side by side with a bare Zenoh echo, in one run.

Echo and path take turns, each in fresh processes, because the latency of a session has regimes
that last for its whole life and because other work on the machine comes and goes: only medians
over several starts, and ratios within one run, mean anything. What exactly is measured is said in
``docs/benchmarks.md``.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from statistics import median
from typing import Any

from shearline.deploy.processes import spawn_command
from shearline.deploy.transport.child import BenchFailed, measured
from shearline.learner.dispatcher.entries import ResultTaken
from shearline.learner.run.folder import JOURNAL
from shearline.learner.run.journal import read

#: Fresh processes that a median is taken over.
STARTS = 7

#: Round trips of each evaluator in one start.
TRIPS = 1500

#: Evaluators whose ratios are given.
FEW = (1, 4)

#: Light evaluators, and trials that all of them together do in one episode.
MANY = 256
MANY_TRIALS = 20_000

#: A trial of the utilisation benchmark takes this long [s]; each evaluator runs so many, here and
#: with short ones.
WALL_S = 0.005
WALL_TRIALS = 400

#: Longest time a whole small run may take before it counts as broken [s].
PATIENCE_S = 60.0

#: A short trial [s]: the whole key-in-lock takes fifty times as long.
SHORT_S = 0.001

Figures = dict[str, float]


def measure(
    starts: int = STARTS, trips: int = TRIPS, say: Callable[[str], None] = lambda _: None
) -> Figures:
    """Measure everything.

    Args:
        starts: Fresh starts of each measurement.
        trips: Round trips of each evaluator in one start.
        say: Told what is being measured.

    Returns:
        Figures by name, as in ``docs/benchmarks.md``; times in the unit that the name ends with.
    """
    figures: Figures = {"starts": starts}
    for evaluators in FEW:
        figures |= side_by_side(evaluators, starts, trips, say)
    say("four evaluators with short trials")
    figures |= short(starts)
    say("utilisation")
    figures |= utilisation(starts)
    say(f"{MANY} light evaluators")
    figures |= many(min(starts, 3))
    say("first result")
    figures |= first_result(starts)
    return figures


def side_by_side(
    evaluators: int, starts: int, trips: int, say: Callable[[str], None] = lambda _: None
) -> Figures:
    """Compare round trips and rate of the full path with the echo's, in turns."""
    echo, one, two = [], [], []
    for start in range(starts):
        say(f"{evaluators} evaluators, start {start + 1} of {starts}")
        trials = trips * evaluators
        echo.append(measured("echo", evaluators, trials, 0.0))
        one.append(measured("path", evaluators, 1, trials, 0.0))
        two.append(measured("path", evaluators, 2, trials, 0.0))
    raw_one, raw_two = [e["one"] for e in echo], [e["two"] for e in echo]
    tail = "" if evaluators == 1 else f"_{evaluators}"
    return {
        f"p50_ratio{tail}": _middle(one, "p50_s") / _middle(raw_one, "p50_s"),
        f"rate_ratio{tail}": _middle(two, "rate_hz") / _middle(raw_two, "rate_hz"),
        f"raw_p50{tail}_us": 1e6 * _middle(raw_one, "p50_s"),
        f"raw_p99{tail}_us": 1e6 * _middle(raw_one, "p99_s"),
        f"raw_rate{tail}_hz": _middle(raw_two, "rate_hz"),
        f"raw_cpu{tail}_us": 1e6 * _middle(echo, "cpu_s"),
        f"p50{tail}_us": 1e6 * _middle(one, "p50_s"),
        f"p99{tail}_us": 1e6 * _middle(one, "p99_s"),
        f"rate{tail}_hz": _middle(two, "rate_hz"),
        f"cpu{tail}_us": 1e6 * _middle(two, "cpu_s"),
    }


def short(starts: int) -> Figures:
    """Compare round trips where four evaluators, and echoes, are at work a millisecond each."""
    echo, path = [], []
    for _ in range(starts):
        echo.append(measured("echo", 4, 4 * WALL_TRIALS, SHORT_S)["one"])
        path.append(measured("path", 4, 1, 4 * WALL_TRIALS, SHORT_S))
    return {
        "short_p50_ratio_4": _middle(path, "p50_s") / _middle(echo, "p50_s"),
        "short_raw_p50_4_us": 1e6 * _middle(echo, "p50_s"),
        "short_p50_4_us": 1e6 * _middle(path, "p50_s"),
    }


def utilisation(starts: int) -> Figures:
    """Measure the share of time in which four evaluators run trials of 5 ms."""
    runs = _repeated(starts, "path", 4, 2, 4 * WALL_TRIALS, WALL_S)
    return {"utilisation": _middle(runs, "utilisation")}


def many(starts: int) -> Figures:
    """Measure many light evaluators: how they join, how fast they go, what idle ones cost."""
    runs = _repeated(starts, "path", "crowd", MANY, MANY_TRIALS)
    return {
        "many": MANY,
        "many_join_s": _middle(runs, "join_s"),
        "many_rate_hz": _middle(runs, "rate_hz"),
        "many_cpu_us": 1e6 * _middle(runs, "cpu_s"),
        "many_memory_kb": _middle(runs, "memory_bytes") / 1000,
        "many_idle_learner": _middle(runs, "idle_learner"),
        "many_idle_evaluators": _middle(runs, "idle_evaluators"),
    }


def first_result(starts: int) -> Figures:
    """Time from starting ``shearline up`` with four evaluators to results at the learner."""
    runs = [_first_result() for _ in range(starts)]
    return {
        "first_result_s": _middle(runs, "first_s"),
        "first_result_of_all_s": _middle(runs, "all_s"),
    }


def _first_result() -> Figures:
    """Start a whole run of trials of 10 ms and read from its journal when results came.

    Raises:
        BenchFailed: If not all evaluators took part.
    """
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder, "first")
        words = "up --task sleep-10 --learner random --episodes 1 --trials 300 --evaluators 4"
        arguments = [*words.split(), "--no-record", "--out", str(run), "--json"]
        began_s = time.time()
        child = spawn_command("up", arguments, Path(folder, "up.log"))
        child.process.wait(PATIENCE_S)
        if child.returncode != 0:
            raise BenchFailed(f"shearline up failed: {child.last_words()}")
        firsts: dict[str, float] = {}
        for entry in read(run / JOURNAL):
            if isinstance(entry, ResultTaken):
                firsts.setdefault(entry.evaluator, entry.at_s - began_s)
    if len(firsts) < 4:
        raise BenchFailed(f"expected results of 4 evaluators, got those of {', '.join(firsts)}")
    return {"first_s": min(firsts.values()), "all_s": max(firsts.values())}


def _repeated(starts: int, module: str, *arguments: object) -> list[dict[str, Any]]:
    return [measured(module, *arguments) for _ in range(starts)]


def _middle(runs: Iterable[Mapping[str, float]], name: str) -> float:
    return float(median(run[name] for run in runs))
