"""The 23 parameters."""

from __future__ import annotations

import math
import subprocess
import sys

import pytest

from shearline.evaluator.skill.parameters import BOUNDS, Parameters, parameters, space


def test_there_are_23_and_names_and_order_agree() -> None:
    assert len(BOUNDS) == 23
    assert Parameters._fields == tuple(BOUNDS) == space().names


def test_bounds_are_those_of_the_task_definition() -> None:
    assert BOUNDS["ins_push"] == ("N", 0.0, 20.0)
    assert BOUNDS["app_tilt_x"][2] == pytest.approx(math.radians(8.0))
    assert BOUNDS["ins_k_rot"] == ("N m/rad", 5.0, 200.0)
    assert BOUNDS["con_force"] == ("N", 1.0, 12.0)


def test_a_tuple_is_named_in_order() -> None:
    named = parameters(range(23))
    assert named.app_off_x == 0.0
    assert named.xi == 22.0


def test_a_tuple_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match="23 numbers"):
        parameters([1.0, 2.0])


def test_the_space_needs_neither_engine_nor_compiler() -> None:
    code = (
        "import sys; from shearline.evaluator.keylock_spec import keylock_spec; keylock_spec();"
        "from shearline.evaluator.keylock import KeylockTask; KeylockTask();"
        "sys.exit(bool({'mujoco', 'numba', 'llvmlite'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
