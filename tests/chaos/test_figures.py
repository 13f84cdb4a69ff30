"""What each kind of harm costs, measured; `make chaos` prints the figures of docs/chaos.md."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from chaos.fleet import Fleet, counts, is_busy, is_over

from shearline.deploy.processes import Child
from shearline.learner.dispatcher.entries import AttemptIssued, LearnerBooted

pytestmark = [pytest.mark.chaos, pytest.mark.long]

LEASE_S = 1.0


def asked(trials: int, *further: str, episodes: int = 10) -> list[str]:
    return [
        "--task", "sleep-40", "--learner", "lhs", "--episodes", str(episodes),
        "--trials", str(trials),
        "--lease", str(LEASE_S), *further,
    ]  # fmt: skip


def say(text: str) -> None:
    sys.stdout.write(f"\n{text}\n")


def harms(fleet: Fleet, hangs: Path) -> dict[str, Callable[[], None]]:
    """Return how to hurt the evaluator of each name, started for it."""
    relays = {name: fleet.relay(f"relay-{name}") for name in ("frozen", "half-open", "cut")}
    children: dict[str, Child] = {
        name: fleet.evaluator(name, through=relay.endpoint) for name, relay in relays.items()
    }
    children |= {name: fleet.evaluator(name) for name in ("killed", "stopped")}
    fleet.script("hung", "hanging.py", "hung", "sleep-40", str(hangs))
    return {
        "killed": children["killed"].process.kill,
        "cut": lambda: relays["cut"].order("cut"),
        "stopped": lambda: children["stopped"].process.send_signal(signal.SIGSTOP),
        "hung": hangs.touch,
        "frozen": lambda: relays["frozen"].order("freeze"),
        "half-open": lambda: relays["half-open"].order("hush up"),
    }


def test_how_soon_the_trials_of_a_lost_evaluator_run_elsewhere(tmp_path: Path) -> None:
    # Long episodes: at the end of one, copies for the idle would hide how long a lease takes.
    with Fleet(tmp_path, asked(500, "--no-record", episodes=2)) as fleet:
        learner = fleet.learner()
        harm = harms(fleet, tmp_path / "hangs")
        for name in ("one", "two"):
            fleet.evaluator(name)
        at_s = {}
        for name, hurt in harm.items():
            fleet.when(lambda s, name=name: is_busy(name)(s) and s.pending > 150)  # type: ignore[misc]
            at_s[name] = time.time()
            hurt()
        fleet.outcome(learner)
        fleet.audit()
        took_s = {name: fleet.taken_over_s(name, moment) for name, moment in at_s.items()}
        say("".join(f"{name}: runs elsewhere after {s:.2f} s; " for name, s in took_s.items()))
        for name, s in took_s.items():
            assert s < (0.5 if name in {"killed", "cut"} else LEASE_S + 1.0)


def first_attempts_s(fleet: Fleet) -> list[float]:
    """Return when the first attempt of each life of the learner was handed out [s]."""
    first_s: list[float] = []
    is_first = False
    for entry in fleet.entries():
        if isinstance(entry, LearnerBooted):
            is_first = True
        elif isinstance(entry, AttemptIssued) and is_first:
            first_s.append(entry.at_s)
            is_first = False
    return first_s


def test_half_of_the_evaluators_frozen_for_five_seconds(tmp_path: Path) -> None:
    with Fleet(tmp_path, asked(60, "--no-record")) as fleet:
        learner = fleet.learner()
        children = {name: fleet.evaluator(name) for name in ("a", "b", "c", "d")}
        fleet.when(lambda s: s.counted > 0 and len(s.evaluators) == 4)
        before_s = time.time()
        fleet.when(counts(200))
        began_s = time.time()
        for name in ("c", "d"):
            children[name].process.send_signal(signal.SIGSTOP)
        with pytest.raises(subprocess.TimeoutExpired):
            learner.process.wait(5.0)
        ended_s = time.time()
        for name in ("c", "d"):
            children[name].process.send_signal(signal.SIGCONT)
        fleet.outcome(learner)
        fleet.audit()
        before_hz = fleet.rate_hz({"a", "b"}, before_s, began_s)
        frozen_hz = fleet.rate_hz({"a", "b"}, began_s, ended_s)
        say(
            f"two of four frozen for {ended_s - began_s:.1f} s: the others go from"
            f" {before_hz:.1f}/s to {frozen_hz:.1f}/s, {frozen_hz / before_hz:.0%}"
        )
        assert frozen_hz >= 0.9 * before_hz


@pytest.mark.parametrize("further", [("--no-record",), ()])
def test_how_soon_a_learner_is_back(tmp_path: Path, further: tuple[str, ...]) -> None:
    with Fleet(tmp_path, asked(60, *further)) as fleet:
        learner = fleet.learner()
        for name in ("a", "b", "c", "d"):
            fleet.evaluator(name)
        killed_s = []
        for counted in (100, 250, 400):
            fleet.when(counts(counted))
            killed_s.append(time.time())
            learner.process.kill()
            learner.process.wait()
            learner = fleet.learner("--resume")
        fleet.outcome(learner)
        audit = fleet.audit()
        first_s = first_attempts_s(fleet)[1:]
        figures = [then_s - at_s for then_s, at_s in zip(first_s, killed_s, strict=True)]
        record = "without" if further else "with"
        say(f"learner killed, {record} record: new attempt after "
            + ", ".join(f"{s:.2f} s" for s in figures))  # fmt: skip
        assert len({a.issued.boot for a in audit.attempts.values()}) == 4
        assert max(figures) < 2.0


@pytest.mark.parametrize("mode", ["", "flood", "garbage", "forge", "all"])
def test_what_a_rogue_costs(tmp_path: Path, mode: str) -> None:
    names = ("one", "two", "three")
    with Fleet(tmp_path, asked(40, "--no-record")) as fleet:
        learner = fleet.learner()
        for name in names:
            fleet.evaluator(name)
        fleet.when(counts(20))
        if mode:
            fleet.script("rogue", "rogue.py", fleet.run_dir.name, mode, *names)
        fleet.when(is_over)
        fleet.outcome(learner)
        fleet.audit()
        counted = fleet.counted()
        rate_hz = (len(counted) - 50) / (counted[-1].at_s - counted[49].at_s)
        log = (fleet.run_dir / "learner.log").read_text()
        steps = re.search(r"steps: .*", log)
        assert steps is not None
        say(f"rogue {mode or 'none'}: {rate_hz:.0f} trials/s, {steps[0]}")
