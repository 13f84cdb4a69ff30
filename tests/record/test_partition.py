"""The partition drawn from a snapshot is the learner's own function."""

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.record.partition import SIDE, Samples, decision, middle, plane, samples_of, telling

N = 5


def a_model(seed: int, supports: int = 7) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    return {
        "partition": {
            "kind": "svm-rbf",
            "support": rng.random((supports, N)).tolist(),
            "dual": rng.standard_normal(supports).tolist(),
            "gamma": float(rng.uniform(0.1, 20.0)),
            "intercept": float(rng.standard_normal()),
        },
        "samples": {"u": rng.random((12, N)).tolist(), "good": (rng.random(12) < 0.5).tolist()},
    }


@given(seed=st.integers(0, 999), pair=st.permutations(range(N)))
def test_a_slice_is_the_kernel_expansion_at_each_of_its_points(seed: int, pair: list[int]) -> None:
    model, (x, y) = a_model(seed), pair[:2]
    at = np.random.default_rng(seed + 1).random(N)
    values = decision(model, at, x, y)
    assert values is not None
    part = model["partition"]
    for row, column in ((0, 0), (3, SIDE - 1), (SIDE - 1, 5)):
        u = at.copy()
        u[x], u[y] = (column + 0.5) / SIDE, 1.0 - (row + 0.5) / SIDE
        squares = np.sum((np.array(part["support"]) - u) ** 2, axis=1)
        expected = np.exp(-part["gamma"] * squares) @ part["dual"] + part["intercept"]
        assert values[row, column] == pytest.approx(expected, abs=1e-9)


def test_a_slice_of_another_kind_of_filter_is_its_value_at_each_point() -> None:
    rng = np.random.default_rng(4)
    part = {
        "kind": "network",
        "hidden": rng.standard_normal((N, 3)).tolist(),
        "hidden_offset": rng.standard_normal(3).tolist(),
        "out": rng.standard_normal(3).tolist(),
        "offset": 0.1,
    }
    values = decision({"partition": part}, np.full(N, 0.5), 1, 3)
    assert values is not None
    u = plane(np.full(N, 0.5), 1, 3)[SIDE + 2]  # second row from the top, third column
    hidden = np.tanh((2.0 * u - 1.0) @ part["hidden"] + part["hidden_offset"])
    assert values[1, 2] == pytest.approx(hidden @ part["out"] + 0.1)
    assert u[1] == pytest.approx(2.5 / SIDE)
    assert u[3] == pytest.approx(1.0 - 1.5 / SIDE)


def test_what_is_not_known_is_not_drawn() -> None:
    at = np.full(N, 0.5)
    assert decision({}, at, 0, 1) is None
    assert decision({"partition": None}, at, 0, 1) is None
    assert decision({"partition": {"kind": "oracle"}}, at, 0, 1) is None
    assert decision(a_model(0), np.full(N + 1, 0.5), 0, 1) is None
    assert samples_of({}) is None
    assert samples_of({"samples": {"u": [[0.1], [0.2]], "good": [True]}}) is None


def test_a_slice_goes_through_the_middle_of_what_is_good() -> None:
    samples = Samples(np.array([[0.1, 0.2], [0.3, 0.4], [0.9, 0.9]]), np.array([True, True, False]))
    assert middle({}, samples).tolist() == pytest.approx([0.2, 0.3])
    part = {
        "kind": "svm-rbf",
        "support": [[0.3, 0.5], [0.9, 0.9]],
        "dual": [1.0, 5.0],
        "gamma": 9.0,
        "intercept": 0.0,
    }
    assert middle({"partition": part}, samples).tolist() == [0.3, 0.4]
    nobody = Samples(samples.u, np.zeros(3, dtype=np.bool_))
    assert middle({}, nobody).tolist() == pytest.approx([0.3, 0.4])


@given(st.integers(0, N - 1), st.integers(0, 99))
def test_the_parameter_that_parts_successes_from_failures_tells_most(which: int, seed: int) -> None:
    u = np.random.default_rng(seed).random((60, N))
    assert telling(u, u[:, which] > 0.5)[0] == which


def test_without_both_outcomes_no_parameter_tells() -> None:
    u = np.random.default_rng(0).random((6, N))
    assert telling(u, np.ones(6, dtype=np.bool_)) == list(range(N))
    assert json.loads(json.dumps(telling(u, np.zeros(6, dtype=np.bool_)))) == list(range(N))
