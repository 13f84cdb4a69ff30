from __future__ import annotations

import numpy as np
import pytest
from sklearn.svm import SVC

from shearline.learner.base import Array
from shearline.learner.psp.config import Distance, PSPConfig
from shearline.learner.psp.machine import fit_machine, kernel

RNG = np.random.default_rng(4)
U: Array = RNG.random((80, 3))
GOOD = np.sum((U - 0.4) ** 2, axis=1) < 0.15
ELSEWHERE: Array = RNG.random((50, 3))


@pytest.mark.parametrize("balanced", [False, True])
def test_the_decision_is_the_one_of_the_library(balanced: bool) -> None:  # noqa: FBT001
    config = PSPConfig(svm_c=100.0, balanced=balanced)
    partition = fit_machine(U, GOOD, config)
    machine = SVC(C=100.0, gamma=4.0, class_weight="balanced" if balanced else None).fit(U, GOOD)
    np.testing.assert_allclose(
        partition.decision(ELSEWHERE), machine.decision_function(ELSEWHERE), atol=1e-8
    )


def test_separable_samples_are_parted_without_error() -> None:
    partition = fit_machine(U, GOOD, PSPConfig(svm_c=1e6))
    np.testing.assert_array_equal(partition.decision(U) > 0.0, GOOD)


@pytest.mark.parametrize("distance", list(Distance))
def test_the_gamma_with_the_largest_minimum_distance_wins(distance: Distance) -> None:
    grid = (0.1, 0.3, 1.0, 3.0, 10.0)
    chosen = fit_machine(U, GOOD, PSPConfig(gammas=grid, distance=distance))
    alone = [fit_machine(U, GOOD, PSPConfig(gammas=(g,), distance=distance)) for g in grid]
    distances = [machine.distance for machine in alone]
    assert chosen.distance == pytest.approx(max(distances), rel=2e-3)
    assert len(set(distances)) == len(grid)


def test_the_geometric_distance_is_a_length_in_feature_space() -> None:
    partition = fit_machine(U, GOOD, PSPConfig(distance=Distance.GEOMETRIC))
    nearest = np.min(np.abs(partition.decision(U)))
    normal = partition.dual @ kernel(partition.support, partition.support, partition.gamma)
    assert partition.distance == pytest.approx(nearest / np.sqrt(normal @ partition.dual))
