"""The network between a robot and its learner is cut in the midst of a trial."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import msgspec
import pytest
from chaos.fleet import Fleet, counts
from evaluator.robot.cell import Cell
from evaluator.robot.test_mixed_run import shearline

from shearline.evaluator.robot.spool import Kept
from shearline.learner.dispatcher.entries import ResultTaken

pytestmark = [pytest.mark.slow, pytest.mark.chaos]

TRIALS = 60
RUN = [
    "--task", "keylock", "--learner", "random", "--episodes", "1", "--trials", str(TRIALS),
    "--lease", "1", "--no-record",
]  # fmt: skip


def kept(cell: Cell) -> set[str]:
    """Return the tokens of the results that wait for the learner."""
    files = (cell.state / "spool").glob("*.json")
    return {msgspec.json.decode(path.read_bytes(), type=Kept).result.token for path in files}


def test_a_trial_whose_link_is_cut_finishes_and_its_result_is_delivered_once(
    tmp_path: Path,
) -> None:
    cell = Cell(tmp_path)
    with Fleet(tmp_path, RUN) as fleet, ExitStack() as stack:
        learner, relay = fleet.learner(), fleet.relay("relay")
        attach = ["evaluator", "--connect", relay.endpoint, "--name", "stage"]
        orders = cell.orders()
        attach += ["--robot", orders.robot, "--bounds", orders.bounds]
        stack.enter_context(shearline(*attach, log=tmp_path / "stage.log", typed="confirm\n"))
        fleet.when(counts(2))
        while True:
            cell.until(cell.in_contact, "a contact")
            relay.order("cut")
            cell.until(lambda: not cell.in_contact(), "the end of the trial")
            if waiting := kept(cell):
                break
            relay.order("mend")  # that trial was over before the cut was in force
        assert cell.stands() in {"ready", "retract"}
        assert len(waiting) == 1
        assert kept(cell) == waiting, "nobody has it"
        relay.order("mend")
        fleet.outcome(learner)
        cell.until(lambda: not kept(cell), "an empty spool")
        taken = [e.result.token for e in fleet.entries() if isinstance(e, ResultTaken)]
        assert taken.count(waiting.pop()) == 1
        assert len(fleet.counted()) == TRIALS
        fleet.audit()
