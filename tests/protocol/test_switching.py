"""Threads take turns quickly while a block lasts, and as before when it ends, however it ends."""

import sys
from functools import partial

import pytest

from shearline.protocol.switching import SWITCH_INTERVAL_S, quick_switching

PYTHONS_OWN_S = 0.005


def failing() -> None:
    with quick_switching():
        assert sys.getswitchinterval() == pytest.approx(SWITCH_INTERVAL_S)
        raise KeyError


def test_the_interval_is_short_inside_and_as_it_was_outside(
    request: pytest.FixtureRequest,
) -> None:
    request.addfinalizer(partial(sys.setswitchinterval, sys.getswitchinterval()))
    sys.setswitchinterval(PYTHONS_OWN_S)
    with pytest.raises(KeyError):
        failing()
    assert sys.getswitchinterval() == pytest.approx(PYTHONS_OWN_S)
