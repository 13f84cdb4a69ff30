"""The compiled loop against the bare engine, in one run."""

from __future__ import annotations

import pytest

from shearline.evaluator.skill.bench import measure


@pytest.mark.bench
@pytest.mark.slow
def test_the_loop_is_nearly_as_fast_as_the_bare_engine() -> None:
    found = measure(seconds=5.0)
    assert found["ratio"] >= 0.85
    assert found["ticks"] > 0


def test_both_sides_go_through_the_same_states() -> None:
    # measure() itself asserts, slice by slice, that positions agree to the last bit.
    found = measure(seconds=0.1)
    assert 0.0 < found["ratio"] < 2.0
    assert found["x_realtime"] > 0.0
