"""Evaluators that are killed, stopped, hung, cut off or echoed cost time and nothing else."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest
from chaos.fleet import Fleet, counts, is_busy
from chaos.invariants import expect_founded

from shearline.learner.dispatcher.entries import AttemptIssued

pytestmark = pytest.mark.chaos

LEASE_S = 1.0
TRIALS = 80
RUN = [
    "--task", "sleep-40", "--learner", "lhs", "--episodes", "2", "--trials", "40",
    "--lease", str(LEASE_S), "--no-record",
]  # fmt: skip

#: What one core busy with other things may add to a figure that is asserted [s].
SLACK_S = 2.0


def test_the_trials_of_a_killed_evaluator_run_elsewhere_at_once(tmp_path: Path) -> None:
    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        victim = fleet.evaluator("victim")
        fleet.evaluator("one")
        fleet.evaluator("two")
        fleet.when(lambda s: s.counted >= 10 and is_busy("victim")(s) and s.episode == 0)
        at_s = time.time()
        victim.process.kill()
        fleet.outcome(learner)
        fleet.audit()
        assert fleet.taken_over_s("victim", at_s) < 0.5 + SLACK_S


@pytest.mark.parametrize("how", ["stopped", "hung", "frozen", "half-open"])
def test_the_trials_of_a_silent_evaluator_run_elsewhere_after_its_lease(
    tmp_path: Path, how: str
) -> None:
    hangs = tmp_path / "hangs"
    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        relay = fleet.relay("relay")
        if how == "hung":
            victim = fleet.script("victim", "hanging.py", "victim", "sleep-40", str(hangs))
        else:
            victim = fleet.evaluator("victim", through=relay.endpoint)
        fleet.evaluator("one")
        fleet.evaluator("two")
        fleet.when(lambda s: s.counted >= 10 and is_busy("victim")(s) and s.episode == 0)
        at_s = time.time()
        match how:
            case "stopped":
                victim.process.send_signal(signal.SIGSTOP)
            case "hung":
                hangs.touch()
            case "frozen":
                relay.order("freeze")
            case _:
                relay.order("hush up")
        fleet.outcome(learner)
        fleet.audit()
        assert fleet.taken_over_s("victim", at_s) < LEASE_S + 1.0 + SLACK_S


def test_an_evaluator_that_was_stopped_or_frozen_comes_back_and_works_on(tmp_path: Path) -> None:
    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        relay = fleet.relay("relay")
        stopped = fleet.evaluator("stopped")
        fleet.evaluator("frozen", through=relay.endpoint)
        fleet.when(lambda s: is_busy("stopped")(s) and is_busy("frozen")(s))
        stopped.process.send_signal(signal.SIGSTOP)
        relay.order("freeze")
        silent = {"silent", "gone", "resting"}
        fleet.when(lambda s: all(e.state in silent for e in s.evaluators))
        before = {e.token for e in fleet.entries() if isinstance(e, AttemptIssued)}
        stopped.process.send_signal(signal.SIGCONT)
        relay.order("thaw")
        fleet.outcome(learner)
        fleet.audit()
        after = [e for e in fleet.entries() if isinstance(e, AttemptIssued)]
        again = {e.evaluator for e in after if e.token not in before}
        assert again == {"stopped", "frozen"}
        assert len({e.boot for e in after}) == 2, "an evaluator was not kept"


@pytest.mark.parametrize("weather", ["delay 0.2", "reset", "cut"])
def test_a_bad_line_costs_time_only(tmp_path: Path, weather: str) -> None:
    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        witness = fleet.witness()
        relay = fleet.relay("relay")
        fleet.evaluator("far", through=relay.endpoint)
        fleet.evaluator("near")
        fleet.when(is_busy("far"))
        relay.order(weather)
        fleet.when(counts(50))
        relay.order("delay 0")
        relay.order("mend")
        fleet.outcome(learner)
        audit = fleet.audit()
        expect_founded(fleet.entries(), witness.told())
        assert len({a.issued.boot for a in audit.attempts.values()}) == 2


def test_results_said_again_many_times_count_once(tmp_path: Path) -> None:
    with Fleet(tmp_path, RUN) as fleet:
        learner = fleet.learner()
        witness = fleet.witness()
        fleet.script("repeater", "repeater.py", "run", "0.3", "4")
        for name in ("one", "two", "three"):
            fleet.evaluator(name)
        summary = fleet.outcome(learner)
        fleet.audit()
        assert summary["counted"] == TRIALS
        assert summary["duplicates"] > 0.3 * TRIALS
        told = witness.told()
        expect_founded(fleet.entries(), told)
        assert told
