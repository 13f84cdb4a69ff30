"""What a learner's snapshot says of its partition is what the learner itself decides by."""

import json

import numpy as np
import pytest

from shearline.learner import Space, create
from shearline.learner.ledger import Trials
from shearline.learner.psp.config import Partitioner, PSPConfig
from shearline.learner.psp.partition import fit_partition
from shearline.learner.ranked.reliability import fit_reliability, sigmoid
from shearline.record.report.decision import decision_of


@pytest.mark.parametrize("kind", list(Partitioner), ids=str)
def test_every_kind_of_partition_is_evaluated_as_its_learner_does(kind: Partitioner) -> None:
    rng = np.random.default_rng(0)
    u = rng.random((60, 3))
    fitted = fit_partition(u, u[:, 0] + u[:, 1] ** 2 > 0.8, PSPConfig(partition=kind), seed=1)
    assert fitted is not None
    model = json.loads(json.dumps({"partition": dict(fitted.snapshot())}))
    decide = decision_of(model, 3)
    assert decide is not None
    fresh = rng.random((200, 3))
    np.testing.assert_allclose(decide(fresh), fitted.decision(fresh), atol=1e-9)
    assert decision_of(model, 2) is None, "it belongs to another space"


def test_log_odds_are_evaluated_as_their_learner_does() -> None:
    rng = np.random.default_rng(2)
    u = rng.random((60, 3))
    trials = Trials(np.arange(60), u, np.ones(60), u[:, 0] + u[:, 1] ** 2 > 0.8)
    fitted = fit_reliability(trials, trials.where(trials.success))
    decide = decision_of(json.loads(json.dumps({"partition": dict(fitted.snapshot())})), 3)
    assert decide is not None
    fresh = rng.random((200, 3))
    np.testing.assert_allclose(sigmoid(decide(fresh)), fitted.probability(fresh), atol=1e-9)


def test_what_is_more_likely_to_succeed_than_to_fail_is_good() -> None:
    learner = create("psp-ranked", Space.unit(3), episode_length=20, seed=0)
    for _ in range(3):
        for p in learner.ask(20):
            learner.tell(p.trial, cost=float(p.theta[1]), success=bool(p.theta[0] > 0.4))
    learner.ask(1)
    model = json.loads(json.dumps(learner.snapshot()))
    decide = decision_of(model, 3)
    assert decide is not None
    fresh = np.random.default_rng(1).random((200, 3))
    assert np.mean((decide(fresh) >= 0.0) == (fresh[:, 0] > 0.4)) > 0.8


MACHINE = {"kind": "svm-rbf", "support": [[0.5]], "dual": [1.0], "gamma": 1.0, "intercept": 0.0}


@pytest.mark.parametrize(
    "model",
    [
        {},
        {"partition": None},
        {"partition": {"kind": "oracle"}},
        {"partition": MACHINE | {"support": []}},
    ],
    ids=["nothing", "none yet", "unknown", "no supports"],
)
def test_what_cannot_be_evaluated_is_no_partition(model: dict[str, object]) -> None:
    assert decision_of(model, 1) is None
