"""A plan gives out what it was given, so that any list of tuples can be a run."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner import LearnerError, Space, SwitchError, create, names

SPACE = Space({"push": ("N", 0.0, 20.0), "turns": ("", 1.0, 9.0)})
TUPLES = st.lists(st.tuples(st.floats(0.0, 20.0), st.floats(1.0, 9.0)), min_size=1, max_size=30)


@given(tuples=TUPLES, episode_length=st.integers(1, 40))
def test_every_tuple_is_given_out_once_and_in_order(
    tuples: list[tuple[float, float]], episode_length: int
) -> None:
    plan = create("plan", SPACE, episode_length, tuples=tuples)
    proposals = plan.ask(len(tuples))
    assert [p.trial for p in proposals] == list(range(len(tuples)))
    np.testing.assert_allclose([p.theta for p in proposals], tuples, rtol=0, atol=1e-12)
    assert all(SPACE.contains(p.theta) for p in proposals)


def test_outcomes_change_nothing() -> None:
    plan = create("plan", SPACE, 1, tuples=[(1.0, 2.0), (3.0, 4.0)])
    plan.tell(plan.ask(1)[0].trial, cost=0.0, success=False)
    np.testing.assert_allclose(plan.ask(1)[0].theta, [3.0, 4.0])


def test_more_than_the_plan_has_is_refused() -> None:
    plan = create("plan", SPACE, 2, tuples=[(1.0, 2.0)])
    with pytest.raises(LearnerError, match="1 tuples"):
        plan.ask(2)


@pytest.mark.parametrize(
    ("tuples", "said"),
    [([], "0 tuples"), ([(1.0,)], "2 values"), ([(1.0, 2.0), (21.0, 2.0)], "tuple 1")],
)
def test_a_plan_that_cannot_be_tried_is_refused(tuples: list[object], said: str) -> None:
    with pytest.raises(SwitchError, match=said):
        create("plan", SPACE, 5, tuples=tuples)


def test_a_plan_is_not_offered_as_a_learner() -> None:
    assert "plan" not in names()
