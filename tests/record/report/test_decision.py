"""What a learner's snapshot says of its partition is what the learner itself decides by."""

import json

import numpy as np
import pytest

from shearline.learner.psp.config import Partitioner, PSPConfig
from shearline.learner.psp.partition import fit_partition
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


MACHINE = {"kind": "svm-rbf", "support": [[0.5]], "dual": [1.0], "gamma": 1.0, "intercept": 0.0}


@pytest.mark.parametrize(
    "model",
    [
        {},
        {"partition": None},
        {"partition": {"kind": "oracle"}},
        {"partition": MACHINE | {"support": []}},
        {"partition": MACHINE, "elite": {"centre": [0.5], "covariance": [[1.0]]}},
    ],
    ids=["nothing", "none yet", "unknown", "no supports", "in units of the elite"],
)
def test_what_cannot_be_evaluated_is_no_partition(model: dict[str, object]) -> None:
    assert decision_of(model, 1) is None
