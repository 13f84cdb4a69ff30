"""One trial in this process: bounds before the task, and no fault that escapes."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.base import Array, Outcome, Trace, TrialRejected
from shearline.evaluator.builtin import BowlTask
from shearline.evaluator.local import EXTRAS_MAX, objection, run_trial, trace_data
from shearline.protocol.codec import decode, encode
from shearline.protocol.messages import OutcomeKind, Result, TraceData
from shearline.protocol.pose import Placed
from shearline.protocol.space import Space

SPACE = Space({"push": ("N", 0.0, 20.0), "turn": ("rad", -1.0, 1.0)})


class Returning(BowlTask):
    """Gives whatever outcome it was made with."""

    def __init__(self, outcome: Outcome) -> None:
        super().__init__(0)
        self.outcome = outcome

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
        del theta, seed, beat
        return self.outcome


@given(st.lists(st.floats(), max_size=3))
def test_a_tuple_is_tried_only_if_the_space_contains_it(theta: list[float]) -> None:
    fits = len(theta) == 2 and SPACE.contains(theta)
    assert (objection(SPACE, theta) == "") == fits


def test_an_objection_names_the_parameter_its_value_and_its_bounds() -> None:
    assert objection(SPACE, [1.0, 1.5]) == "turn = 1.5 rad is outside [-1, 1]"
    assert objection(SPACE, [math.nan, 0.0]) == "push = nan N is outside [0, 20]"
    assert objection(SPACE, [1.0]) == "expected 2 parameters, got shape (1,)"


@given(st.dictionaries(st.text(max_size=8), st.floats(), max_size=100))
def test_whatever_extras_a_task_gives_the_result_can_be_sent(extras: dict[str, float]) -> None:
    outcome = Outcome(cost=1.0, success=False, why="x" * 9999, digest="f" * 999, extras=extras)
    verdict = run_trial(Returning(outcome), [0.0, 0.0], 1)
    result = Result(
        boot="boot-0001",
        token="token-01",
        trial=0,
        kind=verdict.kind,
        cost=verdict.cost,
        seed=1,
        digest=verdict.digest,
        why=verdict.why,
        extras=dict(verdict.extras),
    )
    assert decode(encode(result), Result) == result
    finite = [v for v in extras.values() if math.isfinite(v)]
    assert len(result.extras) == min(len(finite), EXTRAS_MAX)


@pytest.mark.parametrize("cost", [math.nan, math.inf, -math.inf])
def test_a_cost_that_is_not_finite_is_an_abort(cost: float) -> None:
    verdict = run_trial(Returning(Outcome(cost=cost, success=True)), [0.0, 0.0], 1)
    assert verdict.kind is OutcomeKind.ABORTED
    assert verdict.cost == 0.0


def test_a_trace_becomes_columns_that_do_not_change_with_the_next_trial() -> None:
    rows = np.arange(6, dtype=np.float64).reshape(3, 2)
    trace = Trace(
        t_s=rows[:, 0].astype(np.float32),
        columns={"tip.x": ("m", rows[:, 1])},  # type: ignore[dict-item]  # float64 is converted
        events=tuple((float(i), "phase") for i in range(300)),
    )
    message = trace_data(trace, 3, "token-01")
    rows[:] = -1.0
    assert decode(encode(message), TraceData) == message
    columns = np.frombuffer(message.data, "<f4").reshape(len(message.names), message.samples)
    assert columns.tolist() == [[0.0, 2.0, 4.0], [1.0, 3.0, 5.0]]
    assert len(message.events) == 256


def test_where_a_trial_had_its_bodies_goes_with_its_trace() -> None:
    lock = Placed(body="lock", position=[0.5, 0.0, 0.1], quaternion=[0.0, 0.0, 0.0, 1.0])
    message = trace_data(Trace(np.zeros(1, np.float32), {}, placed=(lock,)), 0, "token-01")
    assert decode(encode(message), TraceData).placed == [lock]


def test_columns_of_different_lengths_are_refused() -> None:
    trace = Trace(np.zeros(3, np.float32), {"x": ("m", np.zeros(2, np.float32))})
    with pytest.raises(ValueError, match="same shape"):
        trace_data(trace, 0, "token-01")


def test_a_tuple_that_the_task_itself_rejects_is_rejected() -> None:
    class Narrow(BowlTask):
        def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
            del theta, seed, beat
            raise TrialRejected("x = 4 m is outside this lab's [0, 1]")

    verdict = run_trial(Narrow(1), [4.0, 0.0], 1)
    assert verdict.kind is OutcomeKind.REJECTED
    assert "this lab" in verdict.why
