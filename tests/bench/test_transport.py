"""The transport benchmark measures what it says, and the full path stays within sight of the echo.

The bounds are generous: the suite runs on busy machines. What is asked for and what was measured
stands in ``docs/benchmarks.md``.
"""

import time
from typing import Any

import numpy as np
import pytest

pytest.importorskip("zenoh")

from shearline.deploy.transport.child import BenchFailed, Children, measured, statistics
from shearline.deploy.transport.measure import SHORT_S, first_result, short, side_by_side
from shearline.deploy.transport.path import WARM, Stopwatch, Trip, crowded, one_by_one, steady
from shearline.deploy.transport.task import PARAMETERS, WaitTask
from shearline.learner.dispatcher.events import ResultReceived
from shearline.protocol.messages import OutcomeKind, Result, Trial

THETA = np.zeros(PARAMETERS)


def trip(evaluator: str, number: int) -> Trip:
    return Trip(evaluator, float(number), number + 0.5, 0.0, 0.0)


def test_a_wait_takes_its_time_and_not_less() -> None:
    began_s = time.perf_counter()
    assert WaitTask(0.003).run(THETA, 0, lambda: None).success
    assert time.perf_counter() - began_s >= 0.003


def test_half_of_the_round_trips_are_above_the_median_and_one_in_a_hundred_above_p99() -> None:
    figures = statistics([float(i) for i in range(1000, 0, -1)])
    assert figures == {"p50_s": 501.0, "p99_s": 991.0}


def test_the_clock_starts_when_the_last_evaluator_is_warm_and_stops_before_the_end() -> None:
    early = [trip("a", i) for i in range(500)]
    late = [trip("b", 500 + i) for i in range(500)]
    trips = steady(early + late, evaluators=2, in_flight=4)
    assert trips[0] == late[WARM - 1]
    assert trips[-1] == late[-1 - 16]


def test_an_evaluator_that_never_came_is_no_measurement() -> None:
    with pytest.raises(BenchFailed, match="expected 2 evaluators"):
        steady([trip("a", i) for i in range(500)], evaluators=2, in_flight=2)


def test_the_stopwatch_takes_the_first_result_of_each_trial_it_saw_leave() -> None:
    stopwatch = Stopwatch()
    facts: dict[str, Any] = {"boot": "boot-0001", "token": "token-01", "trial": 1, "seed": 1}
    stopwatch.send(
        "a",
        Trial(**facts, epoch=1, episode=0, attempt=1, theta=[0.0], lease_s=2.0, deadline_s=1.0),
    )
    result = Result(**facts, kind=OutcomeKind.SUCCESS, cost=1.0, wall_s=0.25)
    stopwatch.take(ResultReceived("a", result))
    stopwatch.take(ResultReceived("a", result))
    (only,) = stopwatch.trips
    assert only.evaluator == "a"
    assert only.wall_s == 0.25
    assert only.taken_s >= only.sent_s


def test_memory_and_processor_time_are_those_of_the_children() -> None:
    with Children() as children:
        assert (children.memory_bytes(), children.cpu_s()) == (0, 0.0)


@pytest.mark.slow
def test_a_measurement_that_fails_says_what_its_process_said() -> None:
    with pytest.raises(BenchFailed, match=r"1 1 none .* failed: ValueError"):
        measured("path", 1, 1, "none", 0.0)


@pytest.mark.bench
def test_the_full_path_is_within_sight_of_a_bare_echo() -> None:
    figures = side_by_side(1, starts=3, trips=400)
    # Learner and evaluator look on where the echo sleeps: at best they take half of its time.
    assert 0.3 < figures["p50_ratio"] < 12.0
    assert 0.05 < figures["rate_ratio"] < 1.2


@pytest.mark.bench
def test_short_trials_are_held_against_echoes_that_take_as_long() -> None:
    figures = short(1)
    assert figures["short_raw_p50_4_us"] >= 1e6 * SHORT_S
    assert 0.8 < figures["short_p50_ratio_4"] < 4.0


@pytest.mark.bench
def test_evaluators_are_at_work_most_of_the_time() -> None:
    assert 0.5 < one_by_one(2, 2, 600, 0.005)["utilisation"] <= 1.0


@pytest.mark.bench
def test_many_light_evaluators_all_join_and_all_trials_are_done() -> None:
    figures = crowded(64, 2_000, idle_s=0.2)
    assert figures["joined"] == 64
    assert figures["rate_hz"] > 0.0
    assert figures["memory_bytes"] < 2_000_000


@pytest.mark.bench
def test_the_first_result_comes_before_all_have_given_one() -> None:
    figures = first_result(1)
    assert 0.0 < figures["first_result_s"] <= figures["first_result_of_all_s"]
