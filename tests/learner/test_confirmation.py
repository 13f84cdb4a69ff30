from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.base import Recommendation
from shearline.learner.confirmation import Confirmation, tuples
from shearline.learner.interval import wilson
from shearline.learner.region import Region
from shearline.protocol.messages import Purpose
from shearline.protocol.space import Space

SPACE = Space({"a": ("N", 0.0, 10.0), "b": ("m", -1.0, 1.0)})
REGION = Region(SPACE, np.array([5.0, 0.0]), np.array([1.0, 0.2]), 0.9, 0.95, 60, 58)
ADVICE = Recommendation(np.array([5.0, 0.1]), 0.95, (0.9, 1.0), 0.5, REGION)
NOWHERE = Recommendation(np.array([5.0, 0.1]), 0.5, (0.0, 1.0), 0.5)


def test_the_recommended_tuple_is_tried_as_often_as_asked_and_nothing_else() -> None:
    found = tuples(ADVICE, Purpose.CONFIRMATION, 7, seed=1)
    assert len(found) == 7
    assert all(theta is ADVICE.theta for theta in found)


def test_the_seed_decides_the_draws_from_the_region() -> None:
    first, again, other = (tuples(ADVICE, Purpose.REGION, 20, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    assert all(REGION.contains(theta) for theta in first)
    assert len(np.unique(np.array(first), axis=0)) == 20


def test_without_a_region_there_is_nothing_to_draw_from() -> None:
    assert tuples(NOWHERE, Purpose.REGION, 20, seed=1) == []


@given(trials=st.integers(0, 200), claimed=st.floats(0.0, 1.0), data=st.data())
def test_a_claim_is_borne_out_unless_fresh_trials_contradict_it(
    trials: int, claimed: float, data: st.DataObject
) -> None:
    successes = data.draw(st.integers(0, trials))
    said = Confirmation(claimed, trials, successes, lost=0, mean_cost=None)
    assert said.interval == wilson(successes, trials)
    assert said.bears_out == (claimed <= wilson(successes, trials)[1])


@pytest.mark.parametrize(
    ("successes", "borne_out"), [(100, True), (96, True), (91, True), (90, False), (0, False)]
)
def test_a_claim_of_95_percent_against_a_hundred_trials(successes: int, *, borne_out: bool) -> None:
    assert Confirmation(0.95, 100, successes, 0, 0.5).bears_out is borne_out
