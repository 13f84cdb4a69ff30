"""What is on record about a trial: its digest, and whether the record agrees with itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.base import Task
from shearline.evaluator.builtin import BenchmarkTask
from shearline.evaluator.replay import Case
from shearline.evaluator.replay.case import outcome_digest
from shearline.protocol.messages import OutcomeKind

CaseOf = Callable[[Task, list[float], int], Case]
FINITE = st.floats(allow_nan=False, allow_infinity=False)


@pytest.fixture(scope="module")
def sphere(case_of: CaseOf) -> Case:
    return case_of(BenchmarkTask("sphere"), [0.25] * 20, 3)


@given(FINITE, st.dictionaries(st.sampled_from("abc"), FINITE), st.data())
def test_the_last_bit_of_any_number_changes_the_digest_of_an_outcome(
    cost: float, extras: dict[str, float], data: st.DataObject
) -> None:
    said = outcome_digest(OutcomeKind.SUCCESS, cost, "", extras)
    assert said == outcome_digest(OutcomeKind.SUCCESS, cost, "", dict(reversed(extras.items())))
    assert said != outcome_digest(OutcomeKind.FAILURE, cost, "", extras)
    assert said != outcome_digest(OutcomeKind.SUCCESS, math.nextafter(cost, math.inf), "", extras)
    if extras:
        name = data.draw(st.sampled_from(sorted(extras)))
        moved = extras | {name: math.nextafter(extras[name], math.inf)}
        assert said != outcome_digest(OutcomeKind.SUCCESS, cost, "", moved)


@given(at=st.integers(0, 19))
def test_one_digit_of_any_recorded_parameter_contradicts_what_was_proposed(
    sphere: Case, at: int
) -> None:
    assert sphere.outcome is not None
    assert sphere.contradiction() == ""
    theta = list(sphere.theta)
    theta[at] = math.nextafter(theta[at], 1.0)
    changed = replace(sphere, outcome=msgspec.structs.replace(sphere.outcome, theta=theta))
    assert changed.contradiction().startswith(f"x{at} was proposed as 0.25")


def test_another_seed_or_a_shorter_tuple_contradicts_what_was_proposed(sphere: Case) -> None:
    assert sphere.outcome is not None
    seed = replace(sphere, outcome=msgspec.structs.replace(sphere.outcome, seed=4))
    assert seed.contradiction() == "it was proposed with seed 3, recorded with 4"
    short = msgspec.structs.replace(sphere.outcome, theta=[0.25])
    assert "20 parameters were proposed" in replace(sphere, outcome=short).contradiction()


def test_what_was_not_recorded_contradicts_nothing(sphere: Case) -> None:
    assert replace(sphere, proposed=None).contradiction() == ""
    assert replace(sphere, outcome=None).contradiction() == ""
    assert replace(sphere, outcome=None).digest == ""
