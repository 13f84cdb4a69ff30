"""Lock and key: what must hold for a key that fits."""

from __future__ import annotations

import itertools
import math

import pytest

from shearline.sims.lock import PINS, Key, Lock, bitting, blade, body, walls


def test_no_ramp_of_the_bitting_is_steep_enough_to_lock_itself() -> None:
    for (s0, y0), (s1, y1) in itertools.pairwise(Key().profile()):
        assert s1 > s0
        assert math.degrees(math.atan2(abs(y1 - y0), s1 - s0)) <= 47.0


def test_the_profile_stays_within_the_blade() -> None:
    key = Key()
    profile = key.profile()
    assert profile[0][0] == 0.0
    assert profile[-1] == (key.length_m, key.height_m / 2.0)
    assert max(y for _, y in profile) == key.height_m / 2.0


def test_the_blade_fits_the_keyway_with_the_stated_clearance() -> None:
    lock = Lock()
    box = blade(lock.key)
    assert lock.half_x_m - box.half[0] == pytest.approx(lock.clearance_x_m)
    assert lock.half_y_m - box.half[1] == pytest.approx(lock.clearance_y_m)
    assert lock.depth_m < lock.cavity_m < lock.key.length_m


def test_each_pin_meets_its_cut_when_the_key_is_in() -> None:
    lock = Lock()
    pins = lock.pins()
    assert len(pins) == PINS
    for pin, at, depth in zip(pins, lock.key.cut_at_m, lock.key.cut_depth_m, strict=True):
        assert lock.depth_m - pin.z_m == pytest.approx(at)
        assert pin.rest_y_m < lock.key.height_m / 2.0 - depth


def test_pins_start_on_the_ramp_of_the_nose() -> None:
    lock = Lock()
    assert lock.key.profile()[0][1] < lock.pin_rest_y_m


def test_slabs_lie_below_the_line_they_follow() -> None:
    key = Key()
    for slab, (start, end) in zip(bitting(key), itertools.pairwise(key.profile()), strict=True):
        turn = slab.turn_x
        up = (math.cos(turn), math.sin(turn))
        y = slab.centre[1] + slab.half[1] * up[0]
        z = slab.centre[2] + slab.half[1] * up[1]
        assert y == pytest.approx((start[1] + end[1]) / 2.0)
        assert -z == pytest.approx((start[0] + end[0]) / 2.0)


def test_names_are_unique() -> None:
    lock = Lock()
    names = [box.name for box in (*walls(lock), *bitting(lock.key), *body(lock.key))]
    assert len(names) == len(set(names))
