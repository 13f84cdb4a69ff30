"""The rows that need no learner."""

from __future__ import annotations

import numpy as np

from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.skill.baselines import TUPLES, latin_hypercube, row, tuple_of
from shearline.evaluator.skill.parameters import space


def test_a_latin_hypercube_has_one_tuple_in_each_stratum() -> None:
    unit = space().normalise(latin_hypercube(20, 3))
    strata = np.sort((unit * 20).astype(int), axis=0)
    np.testing.assert_array_equal(strata, np.tile(np.arange(20)[:, None], (1, 23)))


def test_every_fixed_tuple_lies_within_the_bounds() -> None:
    assert all(space().contains(tuple_of(changes)) for changes in TUPLES.values())


def test_a_row_counts_what_happened(task: KeylockTask) -> None:
    swift = row(task, np.tile(tuple_of(TUPLES["swift"]), (6, 1)))
    assert swift["success"] == 1.0
    assert swift["failures"] == {}
    idle = row(task, np.tile(tuple_of({"ins_push": 0.0, "con_force": 1.0}), (2, 1)))
    assert idle["success"] == 0.0
    assert idle["cost_of_successes"] is None
