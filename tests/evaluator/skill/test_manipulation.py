"""What each phase commands."""

from __future__ import annotations

import numpy as np
import pytest

from shearline.evaluator.skill import manipulation, semantic
from shearline.evaluator.skill.manipulation import Command, command, empty_command
from shearline.evaluator.skill.parameters import Parameters, parameters, space
from shearline.sims.panda import Array

TICK_S = 1e-3
START = np.array([0.0, 0.0, -15e-3])


def _p(**named: float) -> Parameters:
    return parameters(space().denormalise(np.full(23, 0.5)))._replace(**named)


def _run(c: Command, phase: int, ticks: int, p: Parameters, tip: Array) -> None:
    for i in range(ticks):
        command(c, phase, i, tip, 0.0, p, TICK_S)


def test_the_approach_ends_at_offset_and_tilt_in_front_of_the_mouth() -> None:
    p = _p(app_off_x=1e-3, app_off_y=-2e-3, app_tilt_x=0.1, app_tilt_y=-0.05)
    c = empty_command()
    _run(c, semantic.APPROACH, 900, p, START)
    np.testing.assert_allclose(c.x, [1e-3, -2e-3, -manipulation.HOVER_M], atol=1e-9)
    np.testing.assert_allclose(c.turn, [0.1, -0.05, 0.0], atol=1e-9)
    np.testing.assert_array_equal(c.v, 0.0)


def test_the_approach_moves_smoothly_from_where_the_tip_is() -> None:
    c, path = empty_command(), []
    for i in range(850):
        command(c, semantic.APPROACH, i, START, 0.0, _p(), TICK_S)
        path.append(c.x[2])
    steps = np.diff(path)
    assert abs(path[0] - START[2]) < 1e-9
    # Minimum jerk peaks at 15/8 of the mean speed.
    assert steps.max() == pytest.approx(12e-3 / 800 * 15.0 / 8.0, rel=0.01)
    assert steps.min() > -1e-12


def test_seeking_contact_never_leads_the_tip_by_more_than_its_bound() -> None:
    c = empty_command()
    c.x[2] = -3e-3
    tip = np.array([0.0, 0.0, -3e-3])
    _run(c, semantic.CONTACT, 2000, _p(con_speed=0.1), tip)
    assert c.x[2] - tip[2] == pytest.approx(manipulation.LEAD_M)


def test_insertion_leads_offset_and_tilt_back_to_the_axis_and_stays() -> None:
    c = empty_command()
    c.x[:2], c.turn[:2] = (1e-3, -2e-3), (0.1, -0.1)
    _run(c, semantic.INSERTION, 100, _p(ins_speed=0.01, ins_rotspeed=0.5), np.zeros(3))
    np.testing.assert_allclose(c.x[:2], [0.0, -1e-3], atol=1e-12)
    np.testing.assert_allclose(c.turn[:2], [0.05, -0.05], atol=1e-12)
    _run(c, semantic.INSERTION, 300, _p(ins_speed=0.01, ins_rotspeed=0.5), np.zeros(3))
    np.testing.assert_allclose(np.concatenate([c.x[:2], c.turn[:2], c.v[:2], c.w]), 0.0, atol=1e-15)


def test_the_push_has_no_stiffness_behind_it_and_is_braked_above_its_speed() -> None:
    c, p = empty_command(), _p(ins_push=13.0, ins_speed=0.05)
    command(c, semantic.INSERTION, 0, np.zeros(3), 0.04, p, TICK_S)
    assert (c.wrench[2], c.stiffness[2], c.drag[2]) == (13.0, 0.0, 0.0)
    command(c, semantic.INSERTION, 1, np.zeros(3), 0.06, p, TICK_S)
    assert c.drag[2] == manipulation.BRAKE
    assert c.v[2] == 0.05


def test_the_wiggle_draws_lissajous_figures() -> None:
    p = _p(wig_a_x=3.0, wig_f_x=1.0, wig_a_y=2.0, wig_f_y=2.0, wig_phi_y=np.pi / 2.0)
    c = empty_command()
    command(c, semantic.INSERTION, 250, np.zeros(3), 0.0, p, TICK_S)
    assert c.wrench[0] == pytest.approx(3.0)
    assert c.wrench[1] == pytest.approx(-2.0)


def test_extraction_pulls_straight_back() -> None:
    c, tip = empty_command(), np.array([1e-4, 2e-4, 20e-3])
    _run(c, semantic.EXTRACTION, 100, _p(), tip)
    assert c.x[2] == pytest.approx(20e-3 - 100 * TICK_S * manipulation.EXTRACTION_SPEED)
    np.testing.assert_array_equal(c.x[:2], tip[:2])
    np.testing.assert_array_equal(c.wrench, 0.0)
