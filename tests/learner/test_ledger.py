from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.errors import LearnerError
from shearline.learner.ledger import ROOM_MIN, Ledger

#: Some of these do not fit into the room there is at first.
COUNTS = st.integers(1, 3 * ROOM_MIN)

OUTCOMES = st.lists(
    st.none() | st.tuples(st.floats(-1e6, 1e6), st.booleans()), min_size=1, max_size=20
)


@given(outcomes=OUTCOMES, seed=st.integers(0, 1000))
def test_trials_come_out_by_number_whatever_the_order_of_tells(
    outcomes: list[tuple[float, bool] | None], seed: int
) -> None:
    ledger = Ledger(2)
    for k in range(len(outcomes)):
        assert ledger.add(np.array([k, -k], dtype=np.float64)) == k
    for k in np.random.default_rng(seed).permutation(len(outcomes)).tolist():
        outcome = outcomes[k]
        if outcome is not None:
            ledger.tell(k, outcome[0], success=outcome[1])
    trials = ledger.trials()
    told = {k: outcome for k, outcome in enumerate(outcomes) if outcome is not None}
    assert trials.number.tolist() == sorted(told)
    assert list(zip(trials.cost.tolist(), trials.success.tolist(), strict=True)) == [
        told[k] for k in sorted(told)
    ]
    assert trials.u.shape == (len(told), 2)
    assert trials.u[:, 0].tolist() == sorted(told)


def test_the_last_trials_are_the_latest_by_number() -> None:
    ledger = Ledger(1)
    for k in range(5):
        ledger.add(np.array([0.1 * k]))
    for k in (4, 0, 2):
        ledger.tell(k, float(k), success=True)
    assert ledger.trials().last(2).number.tolist() == [2, 4]
    assert ledger.trials().last(9).number.tolist() == [0, 2, 4]
    assert len(ledger.trials().last(0)) == 0


@given(count=COUNTS, seed=st.integers(0, 1000))
def test_what_was_entered_is_kept_however_much_comes_after(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    u, cost, success = rng.random((count, 3)), rng.random(count), rng.random(count) < 0.5
    ledger = Ledger(3)
    for k in range(count):
        assert ledger.asked == ledger.add(u[k]) == k
        if k % 3:  # some are never told
            ledger.tell(k, float(cost[k]), success=bool(success[k]))
    told = np.arange(count) % 3 > 0
    trials = ledger.trials()
    np.testing.assert_array_equal(trials.number, np.flatnonzero(told))
    np.testing.assert_array_equal(trials.u, u[told])
    np.testing.assert_array_equal(trials.cost, cost[told])
    np.testing.assert_array_equal(trials.success, success[told])


def test_what_was_handed_out_does_not_change_with_what_comes_after() -> None:
    ledger = Ledger(1)
    theta = np.array([0.25])
    ledger.add(theta)
    ledger.tell(0, 1.0, success=True)
    before = ledger.trials()
    theta[0] = 0.75
    ledger.add(theta)
    ledger.tell(1, 2.0, success=False)
    assert before.u.tolist() == [[0.25]]
    before.u[0] = 9.0
    assert ledger.trials().u.tolist() == [[0.25], [0.75]]


@pytest.mark.parametrize("trial", [-1, 1, ROOM_MIN - 1, ROOM_MIN, 10**9])
def test_a_trial_that_was_never_asked_for_is_refused_even_where_there_is_room(trial: int) -> None:
    ledger = Ledger(1)
    ledger.add(np.array([0.5]))
    with pytest.raises(LearnerError, match="asked for"):
        ledger.tell(trial, 1.0, success=True)
    assert len(ledger.trials()) == 0
