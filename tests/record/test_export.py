"""Trials handed to other programs come back as they were, in every format."""

import csv
import io
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import parquet

from shearline.record.export import Format, exported, to_csv, to_parquet
from shearline.record.reader import Run, open_run
from shearline.record.table import Table


@pytest.fixture
def run(write_run: Callable[..., Path]) -> Run:
    return open_run(write_run())


def test_json_is_the_rows_one_on_each_line(run: Run) -> None:
    lines = exported(run, Format.JSON).decode().splitlines()
    assert [json.loads(line) for line in lines] == list(run.trials())


def test_csv_says_units_in_its_head_and_every_digit(run: Run) -> None:
    head, *rows = csv.reader(io.StringIO(exported(run, Format.CSV).decode(), newline=""))
    assert "theta.ins_push [N]" in head
    assert "cost" in head
    table = run.table()
    for name, column in zip(table, zip(*rows, strict=True), strict=True):
        if table[name].dtype.kind == "f":
            assert [float(cell) for cell in column] == table[name].tolist()
        else:
            assert list(column) == [str(value) for value in table[name].tolist()]


def test_parquet_carries_units_and_the_run(run: Run) -> None:
    table = run.table()
    read = parquet.read_table(io.BytesIO(exported(run, Format.PARQUET)))
    assert read.column_names == list(table)
    assert read.schema.field("theta.ins_k_rot").metadata == {b"unit": b"N m/rad"}
    assert read.schema.field("cost").metadata is None
    assert read.schema.metadata[b"run"] == b"synthetic"
    assert b"[task.space]" in read.schema.metadata[b"run.toml"]
    for name in table:
        assert read.column(name).to_pylist() == table[name].tolist()


@given(
    st.lists(st.floats(allow_infinity=False), min_size=1),
    st.text(st.characters(exclude_categories=["Cs"])),
)
def test_what_is_not_there_is_empty_in_csv_and_null_in_parquet(
    costs: list[float], why: str
) -> None:
    table = Table(
        {"cost": np.array(costs), "why": np.array([why] * len(costs), dtype=np.str_)},
        {"cost": "s", "why": ""},
    )
    _, *rows = csv.reader(io.StringIO(to_csv(table), newline=""))
    read = parquet.read_table(io.BytesIO(to_parquet(table, {})))
    for cost, (cell, text), value in zip(costs, rows, read.column("cost").to_pylist(), strict=True):
        assert text == table["why"][0]
        assert (cell == "") == (value is None) == math.isnan(cost)
        assert math.isnan(cost) or float(cell) == value == cost
