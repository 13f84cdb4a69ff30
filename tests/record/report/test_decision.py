"""What a learner's snapshot says of its partition is what the learner itself decides by."""

import json

import numpy as np
import pytest

from shearline.learner import Space, create
from shearline.learner.psp.config import Partitioner, PSPConfig
from shearline.learner.psp.partition import fit_partition
from shearline.learner.ranked.reliability import features
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
    said = model["partition"]
    phi = features(fresh, np.array(said["centre"]), np.array(said["scale"]))
    np.testing.assert_allclose(decide(fresh), phi @ np.array(said["weights"]), atol=1e-9)
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
