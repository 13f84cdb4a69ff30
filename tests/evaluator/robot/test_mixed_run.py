"""Simulators and both real clients in one run, started as people start them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from emulator.kit import FR3, PANDA, Kind
from emulator.process import Emulator
from evaluator.robot.cell import Cell

from shearline.protocol.endpoints import free_endpoint

#: Of learning, and of confirmation on robots alone.
EPISODES, TRIALS, CONFIRMING = 2, 20, 4

PATIENCE_S = 540.0


@contextmanager
def shearline(*arguments: str, log: Path, typed: str = "") -> Iterator[subprocess.Popen[str]]:
    """Run a command; what is typed at its terminal comes first, and the terminal stays open."""
    with log.open("w") as output:
        process = subprocess.Popen(
            [sys.executable, "-m", "shearline.deploy", *arguments],
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=output,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )
    assert process.stdin is not None
    process.stdin.write(typed)
    process.stdin.flush()
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def robot(folder: Path, kind: Kind, stack: ExitStack) -> tuple[Cell, list[str]]:
    """Start a robot with its folder; return it, and the arguments that attach it."""
    own = folder / kind.name
    own.mkdir()
    emulator = stack.enter_context(Emulator(kind.version, folder / f"{kind.name}.emulator"))
    emulator.order("place 1")
    cell = Cell(own, kind, emulator)
    orders = cell.orders()
    where = ["--robot", orders.robot, "--address", orders.address, "--bounds", orders.bounds]
    return cell, [*where, "--name", kind.name]


@pytest.mark.slow
@pytest.mark.chaos
@pytest.mark.long
def test_both_robots_learn_beside_two_simulators_and_confirm_alone(tmp_path: Path) -> None:
    missing = [why for kind in (FR3, PANDA) if (why := kind.missing())]
    if missing:
        pytest.skip(missing[0])
    endpoint, out = free_endpoint(), tmp_path / "run"
    run = ["--task", "keylock", "--learner", "psp-ranked", "--episodes", str(EPISODES)]
    run += ["--trials", str(TRIALS), "--confirm-on", f"robot:{CONFIRMING}", "--out", str(out)]
    with ExitStack() as stack:
        learner = stack.enter_context(
            shearline("learner", *run, "--listen", endpoint, log=tmp_path / "learner.log")
        )
        for kind in (FR3, PANDA):
            cell, where = robot(tmp_path, kind, stack)
            attach = ["evaluator", "--connect", endpoint, *where]
            log = tmp_path / f"{kind.name}.log"
            stack.enter_context(shearline(*attach, log=log, typed="confirm\n"))
            cell.until(lambda cell=cell: "rehearsed" in cell.diary(), "the rehearsal")
        for name in ("sim-1", "sim-2"):
            attach = ["evaluator", "--connect", endpoint, "--name", name, "--patience", "60"]
            stack.enter_context(shearline(*attach, log=tmp_path / f"{name}.log"))
        assert learner.wait(PATIENCE_S) == 0, (tmp_path / "learner.log").read_text()
    listed = subprocess.run(
        [sys.executable, "-m", "shearline.deploy", "trials", str(out), "--json"],
        capture_output=True,
        text=True,
        check=True,
    )
    trials = [json.loads(line) for line in listed.stdout.splitlines()]
    assert len(trials) == EPISODES * TRIALS + CONFIRMING
    assert all(trial["outcome"] in {"success", "failure"} for trial in trials)
    confirming = [trial for trial in trials if trial["purpose"] == "confirmation"]
    assert {trial["evaluator_kind"] for trial in confirming} == {"robot"}
    assert {trial["evaluator"] for trial in trials} == {"fr3", "panda", "sim-1", "sim-2"}
    print(Counter((trial["evaluator"], trial["outcome"]) for trial in trials))  # noqa: T201
