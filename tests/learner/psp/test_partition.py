"""Whatever stands in the port: a law for each kind of filter, and the library as the oracle."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.ensemble import GradientBoostingClassifier, RandomForestClassifier
from sklearn.neural_network import MLPClassifier

from shearline.learner import LearnerError, Space, create
from shearline.learner.base import Array
from shearline.learner.psp.config import Partitioner, PSPConfig
from shearline.learner.psp.network import DECAY, HIDDEN, STEPS_MAX, centred, fit_network
from shearline.learner.psp.partition import Partition, fit_partition, restored
from shearline.learner.psp.trees import TREES, class_weights, fit_boosting, fit_forest
from shearline.learner.threads import fitting

RNG = np.random.default_rng(4)
U: Array = RNG.random((80, 3))
GOOD = np.sum((U - 0.4) ** 2, axis=1) < 0.15
ELSEWHERE: Array = RNG.random((200, 3))
REALLY_GOOD = np.sum((ELSEWHERE - 0.4) ** 2, axis=1) < 0.15


def fitted(kind: Partitioner, *, balanced: bool = False, seed: int = 0) -> Partition:
    with fitting("sklearn.svm"):
        found = fit_partition(U, GOOD, PSPConfig(partition=kind, balanced=balanced), seed)
    assert found is not None
    return found


@pytest.fixture(scope="module", params=list(Partitioner))
def kind(request: pytest.FixtureRequest) -> Partitioner:
    return Partitioner(request.param)


@pytest.fixture(scope="module")
def partition(kind: Partitioner) -> Partition:
    return fitted(kind)


def test_it_parts_what_it_has_not_seen(partition: Partition) -> None:
    values = partition.decision(ELSEWHERE)
    assert values.shape == (200,)
    assert np.mean((values >= 0.0) == REALLY_GOOD) > 0.8


def test_the_same_seed_gives_the_same_filter(kind: Partitioner, partition: Partition) -> None:
    again = fitted(kind)
    np.testing.assert_array_equal(again.decision(ELSEWHERE), partition.decision(ELSEWHERE))


def test_with_balanced_classes_the_rarer_one_gains(kind: Partitioner) -> None:
    assert GOOD.mean() < 0.4
    plain = fitted(kind).decision(ELSEWHERE)
    balanced = fitted(kind, balanced=True).decision(ELSEWHERE)
    assert not np.array_equal(plain, balanced)
    if kind is not Partitioner.FOREST:  # its trees are pure whatever the weights
        assert np.sum(balanced >= 0.0) > np.sum(plain >= 0.0)


def test_a_snapshot_as_json_is_enough_to_compute_the_decision(partition: Partition) -> None:
    said = json.loads(json.dumps(dict(partition.snapshot())))
    np.testing.assert_array_equal(restored(said).decision(ELSEWHERE), partition.decision(ELSEWHERE))


def test_a_snapshot_of_another_kind_is_refused() -> None:
    with pytest.raises(LearnerError, match="svm-rbf, trees or network"):
        restored({"kind": "oracle"})


@given(rows=st.lists(st.integers(0, 199), min_size=1, max_size=20))
@settings(max_examples=25, deadline=None)
def test_a_decision_does_not_depend_on_its_company(partition: Partition, rows: list[int]) -> None:
    together = partition.decision(ELSEWHERE)[rows]
    np.testing.assert_allclose(partition.decision(ELSEWHERE[rows]), together, atol=1e-9)


@pytest.mark.parametrize("label", [True, False])
def test_there_is_nothing_to_part_while_all_labels_agree(
    kind: Partitioner,
    label: bool,  # noqa: FBT001 - pytest passes it
) -> None:
    assert fit_partition(U, np.full(len(U), label), PSPConfig(partition=kind)) is None


@pytest.mark.parametrize("size", [2, 3])
def test_two_samples_are_enough(kind: Partitioner, size: int) -> None:
    with fitting("sklearn.svm"):
        found = fit_partition(U[:size], np.arange(size) == 0, PSPConfig(partition=kind))
    assert found is not None
    assert np.isfinite(found.decision(ELSEWHERE)).all()


def test_contradicting_duplicates_are_parted_somehow(kind: Partitioner) -> None:
    u, good = np.concatenate([U, U]), np.concatenate([GOOD, ~GOOD])
    with fitting("sklearn.svm"):
        found = fit_partition(u, good, PSPConfig(partition=kind, svm_c=1e8))
    assert found is not None
    assert np.isfinite(found.decision(u)).all()


def test_the_forest_decides_as_the_library_does() -> None:
    forest = RandomForestClassifier(n_estimators=TREES, random_state=3).fit(U, GOOD)
    shares = forest.predict_proba(ELSEWHERE)[:, 1]
    ours = fit_forest(U, GOOD, 3, balanced=False).decision(ELSEWHERE)
    np.testing.assert_allclose(ours, shares - 0.5, atol=1e-12)


@pytest.mark.parametrize("balanced", [False, True])
def test_boosting_decides_as_the_library_does(balanced: bool) -> None:  # noqa: FBT001
    weights = class_weights(GOOD) if balanced else None
    library = GradientBoostingClassifier(n_estimators=TREES, random_state=3)
    library.fit(U, GOOD, sample_weight=weights)
    ours = fit_boosting(U, GOOD, 3, balanced=balanced).decision(ELSEWHERE)
    np.testing.assert_allclose(ours, library.decision_function(ELSEWHERE), atol=1e-9)


def test_the_network_decides_as_the_library_does() -> None:
    network = MLPClassifier(
        (HIDDEN,),
        activation="tanh",
        solver="lbfgs",
        alpha=DECAY,
        max_iter=STEPS_MAX,
        random_state=3,
    )
    with fitting("sklearn.svm"):
        chance = network.fit(centred(U), GOOD).predict_proba(centred(ELSEWHERE))[:, 1]
        ours = fit_network(U, GOOD, 3, balanced=False).decision(ELSEWHERE)
    np.testing.assert_allclose(1.0 / (1.0 + np.exp(-ours)), chance, atol=1e-9)


def test_balanced_classes_weigh_the_same() -> None:
    weights = class_weights(GOOD)
    assert weights[GOOD].sum() == pytest.approx(weights[~GOOD].sum())
    assert weights.mean() == pytest.approx(1.0)


def test_psp_proposes_what_its_filter_accepts(kind: Partitioner) -> None:
    learner = create("psp", Space.unit(2), 20, seed=3, partition=str(kind), redraws_max=20_000)
    for episode in range(4):
        proposals = learner.ask(20)
        said = learner.snapshot()["partition"]
        if episode:
            assert isinstance(said, dict)
            tried = np.array([p.theta for p in proposals])
            assert np.all(restored(said).decision(tried) >= -1e-9)
        for p in proposals:
            learner.tell(p.trial, cost=float(p.theta.sum()), success=bool(p.theta.mean() < 0.5))
