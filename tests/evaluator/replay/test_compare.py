"""Two traces are the same if all their bits are; if not, the first difference is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.base import Trace
from shearline.evaluator.replay.compare import alignment, bits, compare, first_difference
from shearline.protocol.pose import Placed

SAMPLES = 40
NAMES = ("t_s", "q.1", "depth", "push")


def trace(samples: int = SAMPLES) -> Trace:
    t_s = np.arange(samples, dtype=np.float32) * np.float32(1e-3)
    wave = np.sin(t_s * 50.0).astype(np.float32)
    columns = {"q.1": ("rad", wave), "depth": ("m", wave * 0.01), "push": ("N", wave + 3)}
    return Trace(t_s, columns, ((0.0, "approach"), (0.02, "contact")))


def with_bit_flipped(whole: Trace, channel: str, sample: int, bit: int) -> Trace:
    values = (whole.t_s if channel == "t_s" else whole.columns[channel][1]).copy()
    values.view(np.uint32)[sample] ^= np.uint32(1 << bit)
    if channel == "t_s":
        return replace(whole, t_s=values)
    unit = whole.columns[channel][0]
    return replace(whole, columns={**whole.columns, channel: (unit, values)})


def thinned(whole: Trace, step: int) -> Trace:
    columns = {name: (unit, values[::step]) for name, (unit, values) in whole.columns.items()}
    return Trace(whole.t_s[::step], columns, whole.events)


def test_a_trace_is_the_same_as_a_copy_of_it() -> None:
    assert compare(trace(), trace()) == ""


@given(st.sampled_from(NAMES), st.integers(0, SAMPLES - 1), st.integers(0, 31))
def test_one_flipped_bit_is_found_where_it_is(channel: str, sample: int, bit: int) -> None:
    whole = trace()
    with np.errstate(all="ignore"):
        found = first_difference(
            with_bit_flipped(whole, channel, sample, bit), whole, np.arange(SAMPLES)
        )
    assert found is not None
    assert (found.channel, found.channels) == (channel, 1)
    assert found.t_s == whole.t_s[sample]


@given(
    st.lists(
        st.tuples(st.sampled_from(NAMES[1:]), st.integers(0, SAMPLES - 1)), min_size=1, max_size=5
    )
)
def test_of_several_differences_the_earliest_is_named(changes: list[tuple[str, int]]) -> None:
    whole = changed = trace()
    for channel, sample in set(changes):
        changed = with_bit_flipped(changed, channel, sample, 3)
    found = first_difference(changed, whole, np.arange(SAMPLES))
    assert found is not None
    assert found.t_s == whole.t_s[min(sample for _, sample in changes)]
    assert found.channels == len({channel for channel, _ in changes})


@given(st.integers(1, 12), st.integers(13, 200))
def test_a_thinned_trace_is_the_same_if_its_samples_are(step: int, samples: int) -> None:
    whole = trace(samples)
    assert compare(thinned(whole, step), whole) == ""


@given(st.integers(2, 9), st.data())
def test_a_thinned_trace_hides_no_change(step: int, data: st.DataObject) -> None:
    whole = trace()
    thin = thinned(whole, step)
    sample = data.draw(st.integers(0, thin.t_s.size - 1))
    channel = data.draw(st.sampled_from(NAMES))
    assert compare(with_bit_flipped(thin, channel, sample, 2), whole)


def test_a_thinned_trace_may_keep_the_last_sample() -> None:
    t_s = trace().t_s
    kept = alignment(np.append(t_s[::6], t_s[-1]), t_s)
    assert kept is not None
    assert kept.tolist() == [0, 6, 12, 18, 24, 30, 36, 39]


@given(st.integers(2, SAMPLES - 1))
def test_a_trace_that_was_cut_off_is_another(samples: int) -> None:
    whole = trace()
    columns = {name: (unit, values[:samples]) for name, (unit, values) in whole.columns.items()}
    assert f"{samples} samples are on record, 40 come out" in compare(
        Trace(whole.t_s[:samples], columns, whole.events), whole
    )
    assert compare(whole, Trace(whole.t_s[:samples], columns, whole.events))


def test_not_a_number_is_itself_and_minus_zero_is_not_zero() -> None:
    nan = np.array([np.nan, 0.0], np.float32)
    same = Trace(np.zeros(2, np.float32), {"x": ("m", nan)})
    assert compare(same, Trace(same.t_s, {"x": ("m", nan.copy())})) == ""
    other = Trace(same.t_s, {"x": ("m", np.array([np.nan, -0.0], np.float32))})
    assert "x is the first to differ" in compare(same, other)


def test_the_words_name_channel_time_amount_and_both_values() -> None:
    whole = trace()
    depth = whole.columns["depth"][1].copy()
    depth[20] += np.float32(0.001)
    changed = replace(whole, columns={**whole.columns, "depth": ("m", depth)})
    said = compare(changed, whole)
    assert said.startswith("depth is the first to differ, at 0.0200 s by 0.001 m (0.009")
    assert "recorded, 0.008" in said


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (replace(trace(), events=((0.0, "approach"), (0.021, "contact"))), "contact at 0.0200 s"),
        (replace(trace(), events=((0.0, "approach"),)), "2 events are on record, 1 here"),
        (replace(trace(), columns={"q.1": trace().columns["q.1"]}), "3 channels are on record, 1"),
        (
            replace(trace(), columns={**trace().columns, "depth": ("mm", trace().t_s)}),
            "channel depth [m] on record is depth [mm] here",
        ),
    ],
)
def test_other_events_and_channels_are_said(other: Trace, said: str) -> None:
    assert said in compare(trace(), other)


def test_a_body_that_stood_elsewhere_is_said_where_the_record_has_it() -> None:
    here = Placed(body="lock", position=[0.5, 0.0, 0.3], quaternion=[0.0, 0.0, 0.0, 1.0])
    there = Placed(body="lock", position=[0.5, 0.0, 0.31], quaternion=[0.0, 0.0, 0.0, 1.0])
    placed = replace(trace(), placed=(here,))
    assert compare(placed, placed) == ""
    assert compare(trace(), placed) == ""
    assert (
        compare(replace(trace(), placed=(there,)), placed)
        == "lock stood elsewhere on record than here"
    )
    assert "lock stood elsewhere" in compare(placed, trace())


def test_an_empty_trace_is_the_same_as_an_empty_one() -> None:
    empty = Trace(np.zeros(0, np.float32), {"x": ("m", np.zeros(0, np.float32))})
    assert compare(empty, empty) == ""
    assert compare(empty, Trace(np.zeros(3, np.float32), {"x": ("m", np.zeros(3, np.float32))}))
    assert bits(empty.t_s).size == 0
