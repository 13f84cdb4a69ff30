"""Outcomes and draws of an experiment."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.protocol.space import Space
from shearline.studies.experiment import SPREADS, Experiment, Outcomes, draws_around


def outcomes(text: str) -> Outcomes:
    """Return outcomes from one letter each: ``s`` succeeded at its place's cost, ``f`` failed."""
    return Outcomes([c == "s" for c in text], [float(k) for k, _ in enumerate(text)])


def experiment(learned: str, fresh: str = "ss", **changes: object) -> Experiment:
    values: dict[str, object] = {
        "contender": "psp",
        "task": "sphere",
        "plant": "mujoco",
        "seed": 0,
        "episodes": 2,
        "learned": outcomes(learned),
        "recommended": [0.5],
        "claimed": 0.9,
        "claimed_low": 0.8,
        "cheapest": [0.4],
        "fresh": outcomes(fresh),
    }
    return Experiment(**(values | changes))  # type: ignore[arg-type]  # one dict for all fields


def test_only_successes_have_a_cost_that_counts() -> None:
    assert outcomes("fsfs").won_cost == pytest.approx(2.0)
    assert outcomes("fsfs").rate == 0.5
    assert math.isnan(outcomes("ff").won_cost)
    assert math.isnan(outcomes("").rate)


def test_the_optimised_cost_is_that_of_the_cheapest_success() -> None:
    assert experiment("fssf").optimised == 1.0
    assert math.isnan(experiment("ffff").optimised)


def test_episodes_are_the_trials_in_order() -> None:
    assert [part.success for part in experiment("sffs").by_episode] == [
        [True, False],
        [False, True],
    ]


def test_a_claim_is_borne_out_if_fresh_trials_allow_it() -> None:
    assert experiment("ss", "s" * 90 + "f" * 10, claimed_low=0.94).bears_out
    assert not experiment("ss", "s" * 80 + "f" * 20, claimed_low=0.94).bears_out


@given(seed=st.integers(0, 100), middle=st.floats(-3.0, 3.0))
def test_draws_stay_in_the_box_and_belong_to_the_seed(seed: int, middle: float) -> None:
    space = Space({"x": ("m", -3.0, 3.0), "y": ("", 0.0, 1.0)})
    drawn = draws_around(space, [middle, 1.0], 5, seed)
    assert len(drawn) == 5 * len(SPREADS)
    assert all(space.contains(one) for one in drawn)
    assert np.array_equal(drawn, draws_around(space, [middle, 1.0], 5, seed))


def test_draws_have_the_spreads_in_order() -> None:
    drawn = np.array(draws_around(Space.unit(1), [0.5], 4000, 1)).reshape(len(SPREADS), -1)
    assert drawn.std(axis=1)[:2] == pytest.approx(SPREADS[:2], rel=0.05)
    assert np.all(np.diff(drawn.std(axis=1)) > 0.0)
