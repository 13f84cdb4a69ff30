"""Phases, verdicts and the clock, as laws over every possible sight."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.skill import semantic
from shearline.evaluator.skill.parameters import parameters, space
from shearline.evaluator.skill.semantic import Decision, Limits, Sight
from shearline.sims.panda import Array

LIMITS = Limits(np.array([40.0] * 4 + [12.0] * 3), 5e-3, 24.5e-3, 400.0)
P = parameters(space().denormalise(np.full(23, 0.5)))
NONE = np.zeros(7)
TICK_S = 1e-3


def _decide(before: Decision, sight: Sight, tau: Array = NONE) -> Decision:
    return semantic.decide(before, sight, tau, P, LIMITS, TICK_S)


def _sight(depth_m: float, *, x_m: float = 0.0, push_n: float = 0.0) -> Sight:
    return Sight(x_m, 0.0, depth_m, push_n, 0.8)


def _at(phase: int, *, clock: int = -1, search: int = 10) -> Decision:
    return Decision(phase, 10, search, clock, semantic.OPEN, 0.0)


def test_contact_follows_the_approach_once_it_has_settled() -> None:
    ticks = round((0.8 + semantic.SETTLE_S) / TICK_S)
    early = Decision(semantic.APPROACH, ticks - 2, 0, -1, semantic.OPEN, 0.0)
    assert _decide(early, _sight(-3e-3)).phase == semantic.APPROACH
    late = Decision(semantic.APPROACH, ticks, 0, -1, semantic.OPEN, 0.0)
    assert _decide(late, _sight(-3e-3)).phase == semantic.CONTACT


def test_insertion_follows_the_learned_contact_force() -> None:
    before = _at(semantic.CONTACT)
    assert _decide(before, _sight(0.0, push_n=P.con_force - 0.1)).phase == semantic.CONTACT
    assert _decide(before, _sight(0.0, push_n=P.con_force)).phase == semantic.INSERTION


@pytest.mark.parametrize("phase", [semantic.APPROACH, semantic.CONTACT, semantic.INSERTION])
def test_the_clock_starts_at_the_mouth_plane_in_any_phase(phase: int) -> None:
    outside = _decide(_at(phase), _sight(-1e-6))
    assert outside.clock_ticks == -1
    crossing = _decide(outside, _sight(0.0))
    assert crossing.clock_ticks == 0
    assert _decide(crossing, _sight(-1e-3)).clock_ticks == 1


def test_depth_reached_is_a_success_and_stops_the_clock() -> None:
    end = _decide(_at(semantic.INSERTION, clock=99), _sight(24.5e-3))
    assert (end.verdict, end.clock_ticks) == (semantic.SUCCESS, 100)
    assert _decide(end, _sight(20e-3)).clock_ticks == 100
    assert semantic.cost(end, LIMITS, TICK_S) == pytest.approx(0.1)


def test_leaving_the_region_of_interest_fails_only_after_the_approach() -> None:
    wide = _sight(-2e-3, x_m=5.1e-3)
    assert _decide(_at(semantic.APPROACH), wide).verdict == semantic.OPEN
    assert _decide(_at(semantic.CONTACT), wide).verdict == semantic.ROI


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_any_joint_over_its_limit_fails(joint: int, sign: float) -> None:
    tau = np.zeros(7)
    tau[joint] = sign * (LIMITS.torque[joint] + 0.01)
    assert _decide(_at(semantic.APPROACH), _sight(-5e-3), tau).verdict == semantic.TORQUE


def test_five_seconds_in_the_lock_fail() -> None:
    assert _decide(_at(semantic.INSERTION, clock=4998), _sight(1e-2)).verdict == semantic.OPEN
    assert _decide(_at(semantic.INSERTION, clock=4999), _sight(1e-2)).verdict == semantic.TIME


def test_five_seconds_without_finding_the_mouth_fail() -> None:
    end = _decide(_at(semantic.INSERTION, search=4999), _sight(-1e-4))
    assert end.verdict == semantic.SEARCH
    assert semantic.cost(end, LIMITS, TICK_S) == pytest.approx(14.8)


@given(
    verdict=st.sampled_from([semantic.TORQUE, semantic.ROI, semantic.TIME, semantic.SEARCH]),
    depth_m=st.floats(-0.1, 24.4e-3),
    clock=st.integers(-1, 5000),
)
def test_no_failure_is_cheaper_than_any_success(verdict: int, depth_m: float, clock: int) -> None:
    failed = Decision(semantic.EXTRACTION, 0, 0, clock, verdict, depth_m)
    slowest = Decision(semantic.EXTRACTION, 0, 0, 4999, semantic.SUCCESS, 24.5e-3)
    cost = semantic.cost(failed, LIMITS, TICK_S)
    assert semantic.cost(slowest, LIMITS, TICK_S) < cost <= 14.8 + 1e-9


def test_a_key_still_in_the_lock_may_not_start() -> None:
    assert semantic.may_start(-15e-3, 0.0, NONE, LIMITS)
    assert not semantic.may_start(16e-3, 0.0, NONE, LIMITS)
    assert not semantic.may_start(-15e-3, 6e-3, NONE, LIMITS)
    assert not semantic.may_start(-15e-3, 0.0, np.full(7, 11.0), LIMITS)


def test_extraction_ends_when_the_key_is_clear_or_its_time_is_up() -> None:
    out = Decision(semantic.EXTRACTION, 10, 0, 50, semantic.SUCCESS, 24.5e-3)
    assert _decide(out, _sight(10e-3)).phase == semantic.EXTRACTION
    assert _decide(out, _sight(-2.1e-3)).phase == semantic.END
    stuck = out._replace(phase_ticks=1499)
    assert _decide(stuck, _sight(10e-3)).phase == semantic.END


def test_names_of_phases_and_verdicts_match_their_numbers() -> None:
    assert semantic.PHASES[semantic.EXTRACTION] == "extraction"
    assert semantic.VERDICTS[semantic.SEARCH] == "search"
    assert semantic.VERDICTS[semantic.SUCCESS] == ""
