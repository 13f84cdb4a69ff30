"""Columns are told apart by their names, whatever the task calls them."""

import numpy as np
import pytest

from shearline.record import columns
from shearline.record.reader import Trace

N = 5


def a_trace(**units: str) -> Trace:
    names = {name.replace("_dot_", "."): unit for name, unit in units.items()}
    return Trace(
        trial=0,
        token="token-00",
        t_s=np.arange(N, dtype=np.float32),
        columns={
            name: (unit, np.full(N, i + 1, np.float32))
            for i, (name, unit) in enumerate(names.items())
        },
        events=(),
    )


def test_a_dot_groups_and_what_people_tune_by_comes_first() -> None:
    trace = a_trace(q_dot_1="rad", q_dot_2="rad", tau_ext_dot_1="N m", depth="m")
    found = columns.groups(trace)
    assert [group.name for group in found] == ["depth", "tau_ext", "q"]
    assert found[2].names == ["q.1", "q.2"]


def test_push_and_wiggle_are_read_together_but_not_forces_and_torques() -> None:
    trace = a_trace(push="N", wiggle_dot_x="N", wiggle_dot_rx="N m")
    found = {group.name: group for group in columns.groups(trace)}
    assert found["push_wiggle"].names == ["push", "wiggle.x"]
    assert found["wiggle"].unit == "N m"


def test_two_units_under_one_head_are_two_groups() -> None:
    found = columns.groups(a_trace(wrench_dot_fx="N", wrench_dot_mx="N m"))
    assert {(group.name, group.unit) for group in found} == {("wrench", "N"), ("wrench_Nm", "N m")}


def test_depth_is_read_in_millimetres() -> None:
    (group,) = columns.groups(a_trace(depth="m"))
    assert group.unit == "mm"
    assert group.values[0].tolist() == [1000.0] * N


def test_torques_are_read_against_their_limits() -> None:
    names = {f"tau_ext_dot_{j + 1}": "N m" for j in range(7)}
    limits = columns.limits_of({"task": {"options": {"torque_big": 40.0, "torque_small": 10.0}}})
    (group,) = columns.groups(a_trace(**names), limits)
    assert group.unit == "% of limit"
    assert [float(values[0]) for values in group.values] == pytest.approx(
        [2.5, 5.0, 7.5, 10.0, 50.0, 60.0, 70.0]
    )


@pytest.mark.parametrize(
    "settings", [{}, {"task": "keylock"}, {"task": {"options": {"torque_big": "high"}}}]
)
def test_without_limits_torques_stay_torques(settings: dict[str, object]) -> None:
    assert columns.limits_of(settings) == {}


def test_tip_and_force_are_found_by_their_axes() -> None:
    names = dict.fromkeys(("tip_dot_x", "tip_dot_y", "tip_dot_z"), "m")
    forces = dict.fromkeys(("wrench_dot_fx", "wrench_dot_fy", "wrench_dot_fz"), "N")
    trace = a_trace(**names, **forces)
    tip, force = columns.tip(trace), columns.force(trace)
    assert tip is not None
    assert force is not None
    assert tip[0].tolist() == [1.0, 2.0, 3.0]
    assert force[0].tolist() == [4.0, 5.0, 6.0]
    assert columns.tip(a_trace(x="m")) is None
    assert columns.force(a_trace(x="m")) is None


def test_a_tip_whose_height_is_the_depth_stands_in_the_lock() -> None:
    depth = np.arange(N, dtype=np.float32)
    base = {"tip.x": ("m", depth), "tip.y": ("m", depth), "tip.z": ("m", depth)}
    inside = Trace(0, "token-00", depth, {**base, "depth": ("m", depth)}, ())
    outside = Trace(0, "token-00", depth, {**base, "depth": ("m", depth + 1)}, ())
    assert columns.in_lock(inside)
    assert not columns.in_lock(outside)
    assert not columns.in_lock(Trace(0, "token-00", depth, base, ()))
