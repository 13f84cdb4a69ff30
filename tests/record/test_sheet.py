"""Rows gathered by entity arrive as they were said."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from hypothesis import given
from hypothesis import strategies as st

from shearline.record.sheet import Sheet


class Columns:
    """Takes what a sheet hands over in place of an archetype."""

    asked: dict[str, Any]

    @classmethod
    def columns(cls, **components: Any) -> rr.ComponentColumnList:
        cls.asked = components
        return rr.Scalars.columns(scalars=np.zeros(len(next(iter(components.values())))))


@given(lengths=st.lists(st.integers(0, 4), min_size=1, max_size=6))
def test_rows_of_different_lengths_are_joined_in_order(lengths: list[int]) -> None:
    stream = rr.RecordingStream("sheet")
    stream.memory_recording()
    sheet = Sheet(stream)
    for trial, length in enumerate(lengths):
        sheet.row("a", {"trial": trial}, Columns, scalars=np.full(length, float(trial)))
    sheet.flush()
    expected = [trial for trial, length in enumerate(lengths) for _ in range(length)]
    assert np.array_equal(Columns.asked["scalars"], expected)


def test_texts_stay_texts_and_nothing_is_sent_twice() -> None:
    stream = rr.RecordingStream("sheet")
    stream.memory_recording()
    sheet = Sheet(stream)
    sheet.row("a", {"trial": 0}, Columns, text=["one"])
    sheet.row("a", {"trial": 1}, Columns, text=["two", "three"])
    sheet.flush()
    assert Columns.asked == {"text": ["one", "two", "three"]}
    Columns.asked = {}
    sheet.flush()
    assert Columns.asked == {}


@pytest.mark.parametrize("timelines", [("trial",), ("trial", "rank", "clock"), ("played",)])
def test_many_rows_reach_a_file(timelines: tuple[str, ...], tmp_path: Path) -> None:
    stream = rr.RecordingStream("sheet")
    stream.save(tmp_path / "a.rrd")
    sheet = Sheet(stream)
    times = {name: np.arange(1000.0) for name in timelines}
    sheet.rows("a", times, rr.Points3D, each=2, positions=np.ones((2000, 3), np.float32))
    sheet.flush()
    stream.flush()
    stream.disconnect()
    assert (tmp_path / "a.rrd").stat().st_size > 2000 * 3 * 4 / 10
