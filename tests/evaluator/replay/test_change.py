"""What if: a parameter by its name, in its unit, within its bounds."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.replay.change import Change, change_of
from shearline.protocol.errors import ConfigError
from shearline.protocol.space import Space

SPACE = Space(
    {
        "ins_push": ("N", 0.0, 20.0),
        "con_k_xy": ("N/m", 100.0, 2000.0),
        "ins_k_xy": ("N/m", 100.0, 2000.0),
        "xi": ("", 0.1, 1.0),
    }
)
THETA = (5.0, 200.0, 300.0, 0.5)


@given(
    st.floats(0.0, 20.0), st.sampled_from(["ins_push={}", "push={}", "ins_push={} N", "push={}N"])
)
def test_a_value_replaces_one_parameter_and_no_other(value: float, form: str) -> None:
    change = change_of(SPACE, [form.format(repr(value))])
    assert change.applied(SPACE, THETA) == (value, *THETA[1:])


@given(st.floats(allow_nan=False).filter(lambda x: not 0.0 <= x <= 20.0))
def test_a_value_out_of_bounds_is_refused(value: float) -> None:
    with pytest.raises(ConfigError, match="ins_push"):
        change_of(SPACE, [f"push={value!r}"])


@given(st.text(max_size=12) | st.from_regex(r"(push|xi|k_xy)=[-+.e\d]{1,6} ?N?", fullmatch=True))
def test_whatever_is_typed_is_a_change_within_bounds_or_refused(word: str) -> None:
    try:
        change = change_of(SPACE, [word])
    except ConfigError:
        return
    assert SPACE.contains(change.applied(SPACE, THETA))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["push"], r"expected NAME=VALUE, e\.g\. ins_push=1, got 'push'"),
        (["pull=1"], r"no parameter 'pull' .*ins_push \[N\].*, xi$"),
        (["k_xy=300"], "con_k_xy or ins_k_xy: write the whole name"),
        (["push=21"], "expected ins_push from 0 to 20 N, got 21"),
        (["push=12 kN"], "expected ins_push in N, got 'kN'"),
        (["xi=0.5 N"], "expected xi in no unit, got 'N'"),
        (["push=much"], "expected a number for ins_push from 0 to 20 N, got 'much'"),
        (["push=nan"], "expected a number"),
        (["push=1", "ins_push=2"], "given twice"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_what_was_expected(
    words: list[str], said: str
) -> None:
    with pytest.raises(ConfigError, match=said):
        change_of(SPACE, words)


def test_nothing_typed_is_no_change() -> None:
    assert not change_of(SPACE, [])
    assert change_of(SPACE, [], seed=0)
    assert Change().applied(SPACE, THETA) == THETA
