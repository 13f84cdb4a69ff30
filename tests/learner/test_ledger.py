from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.ledger import Ledger

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
