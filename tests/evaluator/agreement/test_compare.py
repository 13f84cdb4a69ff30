"""Both engines agree with each other, and with closed forms: the short form of the study."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shearline.evaluator.agreement import analytic, scenes
from shearline.evaluator.agreement.compare import ENGINES, Findings, Row, compare
from shearline.evaluator.keylock import BulletKeylockTask, KeylockTask


@pytest.fixture(scope="module")
def tasks() -> tuple[KeylockTask, BulletKeylockTask]:
    return KeylockTask(), BulletKeylockTask()


def test_the_tip_goes_the_same_way_through_free_space(
    tasks: tuple[KeylockTask, BulletKeylockTask],
) -> None:
    ours, theirs = (scenes.through_free_space(task.plant, 0) for task in tasks)
    assert np.ptp(ours, axis=0).max() > 5e-3
    assert math.sqrt(float(np.mean(np.sum((ours - theirs) ** 2, axis=1)))) < 1e-4


def test_the_face_pushes_back_with_what_it_is_pushed(
    tasks: tuple[KeylockTask, BulletKeylockTask],
) -> None:
    for task in tasks:
        assert scenes.against_the_face(task.plant, 10.0) == pytest.approx(10.0, rel=0.01)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_pendulum_keeps_its_time(engine: str) -> None:
    found, expected = analytic.pendulum(engine)
    assert found == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_block_slides_with_the_friction_it_was_given(engine: str) -> None:
    found, expected = analytic.slope(engine)
    assert found == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_block_holds_below_the_edge_of_the_cone_and_not_above(engine: str) -> None:
    assert analytic.holds(engine, 0.98)
    assert not analytic.holds(engine, 1.05)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_blow_keeps_the_momentum_and_at_most_half_of_the_speed_between_the_blocks(
    engine: str,
) -> None:
    found, expected = analytic.impact(engine)
    assert expected * (1.0 - 1e-6) <= found <= 1.5 * expected


@pytest.mark.slow
@pytest.mark.parametrize("task", ["keylock", "keylock+grasp+pads+noise"])
def test_every_comparison_of_the_study_is_within_its_limit(task: str) -> None:
    found = Findings()
    wrong = [row for row in compare(12, 2, found, task) if not row.agrees]
    assert not wrong
    assert len(found.tried) == 12
    assert len(found.force) == len(found.slip) == 2


def test_a_difference_above_the_limit_is_no_agreement() -> None:
    assert Row("", "", 1.0, 1.2, None, 0.2, 0.2).agrees
    assert not Row("", "", 1.0, 1.3, None, 0.3, 0.2).agrees
