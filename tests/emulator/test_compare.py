"""Tuples go the same way in the simulation and through a robot's path."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from emulator.compare import LAB, compare, summary, tuples
from emulator.kit import Kind, kinds
from emulator.process import Emulator

from shearline.evaluator.robot.bounds import read_bounds


def test_half_of_the_tuples_are_all_over_and_half_near_the_canary_and_a_lab_allows_all() -> None:
    lab = read_bounds(LAB)
    drawn = tuples(lab, 50)
    assert all(lab.objection(theta) == "" for theta in drawn)
    off = np.abs(drawn - lab.canary_tuple()).mean(axis=0)
    near = np.abs(drawn[25:] - lab.canary_tuple()).mean(axis=0)
    assert (near < off).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", kinds())
def test_good_tuples_cost_much_the_same(kind: Kind, tmp_path: Path) -> None:
    lab = read_bounds(LAB)
    with Emulator(kind.version, tmp_path / "log") as robot:
        pairs = list(compare(kind, robot, tuples(lab, 8)[4:], lab))
    assert sum(pair.agrees for pair in pairs) >= 3, summary(pairs)
    assert abs(np.nanmedian([pair.dearer for pair in pairs])) < 0.5, summary(pairs)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("kind", kinds())
def test_most_of_fifty_tuples_come_to_the_same_verdict(kind: Kind, tmp_path: Path) -> None:
    lab = read_bounds(LAB)
    with Emulator(kind.version, tmp_path / "log") as robot:
        pairs = list(compare(kind, robot, tuples(lab, 50), lab))
    print(summary(pairs))  # noqa: T201
    assert sum(pair.agrees for pair in pairs) >= 40
