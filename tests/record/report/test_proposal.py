"""Ellipses of what a learner draws from."""

from typing import Any

import numpy as np
import pytest

from shearline.record.report.proposal import REACH, ellipses

COVARIANCE = np.array([[0.04, 0.0, 0.012], [0.0, 0.5, 0.0], [0.012, 0.0, 0.01]])


def test_an_ellipse_lies_two_deviations_around_its_mean() -> None:
    mean = np.array([0.3, 0.9, 0.6])
    model = {"elite": {"centre": mean.tolist(), "covariance": COVARIANCE.tolist()}}
    (ellipse,) = ellipses(model, 0, 2, 3)
    off = ellipse - mean[[0, 2]]
    part = COVARIANCE[np.ix_([0, 2], [0, 2])]
    distance = np.sqrt(np.einsum("pi,ij,pj->p", off, np.linalg.inv(part), off))
    np.testing.assert_allclose(distance, REACH)
    np.testing.assert_allclose(ellipse[0], ellipse[-1])


def test_a_mixture_has_an_ellipse_for_each_component() -> None:
    mixture = {"means": [[0.1, 0.2], [0.3, 0.4]], "covariances": [np.eye(2).tolist()] * 2}
    assert len(list(ellipses({"mixture": mixture}, 0, 1, 2))) == 2


@pytest.mark.parametrize(
    "model", [{}, {"mixture": None}, {"elite": {"centre": [0.1], "covariance": [[1.0]]}}]
)
def test_what_a_snapshot_does_not_say_is_not_drawn(model: dict[str, Any]) -> None:
    assert list(ellipses(model, 0, 1, 2)) == []
