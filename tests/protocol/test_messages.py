"""What the message types themselves promise."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from shearline.protocol.codec import decode, encode
from shearline.protocol.messages import TEXT_CHARS_MAX, Bye, TraceData, clip
from shearline.protocol.task import TaskSpec, digest

SPEC = TaskSpec(
    name="keylock", space={"push": ("N", 0.0, 20.0)}, options={"level": "easy"}, trial_s=20.0
)


@given(st.text(st.characters(), max_size=3000) | st.just("\ud800" * 9))
def test_clipped_text_can_always_be_sent(text: str) -> None:
    said = Bye(boot="boot-0001", why=clip(text))
    assert decode(encode(said), Bye) == said


def test_text_that_fits_is_not_clipped() -> None:
    assert clip("ü" * TEXT_CHARS_MAX) == "ü" * TEXT_CHARS_MAX
    assert len(clip("ü" * 9999)) == TEXT_CHARS_MAX


@pytest.mark.parametrize(
    "other",
    [
        replace(SPEC, name="keylock-jam"),
        replace(SPEC, space={"push": ("N", 0.0, 21.0)}),
        replace(SPEC, space={"push": ("kN", 0.0, 20.0)}),
        replace(SPEC, options={"level": "hard"}),
        replace(SPEC, trial_s=21.0),
    ],
)
def test_the_digest_differs_when_what_is_learned_differs(other: TaskSpec) -> None:
    assert digest(other) != digest(SPEC)
    assert digest(replace(other, **{f: getattr(SPEC, f) for f in SPEC.__struct_fields__})) == (
        digest(SPEC)
    )


def test_the_order_of_parameters_is_part_of_what_is_learned() -> None:
    a, b = ("a", ("m", 0.0, 1.0)), ("b", ("m", 0.0, 1.0))
    assert digest(replace(SPEC, space=dict([a, b]))) != digest(replace(SPEC, space=dict([b, a])))


def test_a_trace_cannot_be_made_of_columns_that_do_not_fit() -> None:
    with pytest.raises(ValueError, match="expected a unit for each of 1 names and 8 bytes"):
        TraceData(trial=0, token="token-01", samples=2, names=["x"], units=["m"], data=b"")
