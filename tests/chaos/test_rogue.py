"""A client that floods, talks garbage and forges has no effect but the noise it makes.

It has no token that was not overheard, and sends nothing well-formed that would need one. What
only access control can stop (orders in the operator's name, evaluators without number that take
trials and never answer) is not tried here.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from chaos.fleet import Fleet, is_over
from chaos.rogue import FORGED_COST

from shearline.learner.dispatcher.entries import AttemptLapsed, ResultTaken

pytestmark = pytest.mark.chaos

NAMES = ("one", "two", "three")
RUN = [
    "--task", "sleep-40", "--learner", "lhs", "--episodes", "4", "--trials", "40",
    "--lease", "2", "--no-record",
]  # fmt: skip

#: A learner that waited for a peer would wait so long again and again [ms]. By the wall, and so of
#: all steps but one in a hundred: at a load of 30 a single one waited 1.9 s for a core.
BLOCKED_MS = 500.0

#: Attempts that may lapse: what three evaluators hold, once. The flood takes what it can of the
#: machine, and one that is not heard for two seconds, or cut off, is rightly taken for gone.
LAPSES_MAX = 6

#: What the learner itself may spend on a step, whatever else the machine does [ms].
STEP_CPU_MS = 50.0


def test_a_rogue_has_no_effect(tmp_path: Path) -> None:
    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        rogue = fleet.script("rogue", "rogue.py", "run", "all", *NAMES)
        log = fleet.run_dir / "learner.log"
        fleet.when(lambda _: "ignored on" in log.read_text())  # it is at work
        for name in NAMES:
            fleet.evaluator(name)
        last = fleet.when(is_over)
        assert rogue.returncode is None, "the rogue died before the run ended"
        fleet.outcome(learner)
        audit = fleet.audit()
        entries = fleet.entries()
        assert FORGED_COST not in {result.cost for result in audit.counted.values()}
        assert {e.evaluator for e in entries if isinstance(e, ResultTaken)} <= set(NAMES)
        assert {e.evaluator for e in last.evaluators} == set(NAMES)
        assert sum(isinstance(e, AttemptLapsed) for e in entries) <= LAPSES_MAX
        assert log.stat().st_size < 100_000
        noise = re.search(r"malformed (\d+), dropped (\d+)", log.read_text())
        assert noise is not None
        assert int(noise[1]) > 100
        assert last.step_ms_p99 < BLOCKED_MS
        assert last.step_cpu_ms_max < STEP_CPU_MS
