"""A learner that is killed, or lost behind a router, goes on with everything it acknowledged."""

from __future__ import annotations

from pathlib import Path

import pytest
from chaos.fleet import Fleet, counts
from chaos.invariants import expect_founded, expect_kept

from shearline.learner.dispatcher.entries import AnyEntry, AttemptIssued, TrialsProposed
from shearline.protocol.endpoints import free_endpoint

pytestmark = pytest.mark.chaos


def run(task: str, learner: str = "lhs") -> list[str]:
    return [
        "--task", task, "--learner", learner, "--episodes", "3", "--trials", "30",
        "--lease", "1", "--no-record",
    ]  # fmt: skip


def proposals(entries: list[AnyEntry]) -> list[list[float]]:
    """Return every tuple that was proposed, in order."""
    opened = [entry for entry in entries if isinstance(entry, TrialsProposed)]
    return [planned.theta for entry in opened for planned in entry.trials]


def test_a_learner_killed_again_and_again_proposes_what_an_undisturbed_one_does(
    tmp_path: Path,
) -> None:
    (tmp_path / "calm").mkdir()
    with Fleet(tmp_path / "calm", run("sleep-1", "psp")) as calm:
        learner = calm.learner()
        calm.evaluator("one")
        calm.outcome(learner)
        expected = proposals(calm.entries())
    with Fleet(tmp_path, run("sleep-40", "psp")) as fleet:
        learner = fleet.learner()
        witness = fleet.witness()
        evaluators = [fleet.evaluator(name) for name in ("one", "two", "three")]
        for counted in (15, 45):
            fleet.when(counts(counted))
            learner.process.kill()
            learner.process.wait()
            before = fleet.entries()
            learner = fleet.learner("--resume")
            expect_kept(before, fleet.entries())
        fleet.outcome(learner)
        audit = fleet.audit()
        assert audit.epochs == 3
        expect_kept(before, fleet.entries())
        expect_founded(fleet.entries(), witness.told())
        assert proposals(fleet.entries()) == expected
        assert [child.process.wait(10) for child in evaluators] == [0, 0, 0]
        assert len({a.issued.boot for a in audit.attempts.values()}) == 3


def test_a_router_that_stands_between_may_be_killed_in_mid_run(tmp_path: Path) -> None:
    hub_endpoint = free_endpoint()
    with Fleet(tmp_path, run("sleep-40")) as fleet:
        learner = fleet.learner("--through", hub_endpoint)
        hub = fleet.script("hub", "hub.py", at=hub_endpoint)
        for name in ("one", "two"):
            fleet.evaluator(name, through=hub_endpoint)
        for counted in (20, 50):
            fleet.when(counts(counted))
            hub.process.kill()
            hub.process.wait()
            hub = fleet.script("hub", "hub.py", at=hub_endpoint)
        fleet.outcome(learner)
        audit = fleet.audit()
        assert len({a.issued.boot for a in audit.attempts.values()}) == 2
        late = [e for e in fleet.entries() if isinstance(e, AttemptIssued)][-20:]
        assert {e.evaluator for e in late} == {"one", "two"}
