"""Trials as columns: the same facts as the rows, with units."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import shearline.record
from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Counted, OutcomeKind
from shearline.record.table import table_of

WriteRun = Callable[..., Path]


def counted(trial: int, kind: OutcomeKind | None, theta: list[float], **extras: float) -> Counted:
    return Counted(
        trial=trial,
        episode=trial // 2,
        theta=theta,
        kind=kind,
        cost=1.5,
        seed=2**63 - 1,
        evaluator="sim-0",
        attempts=1,
        late=False,
        engine="e",
        digest="d",
        wall_s=0.1,
        why="",
        extras=extras,
        at_s=3.0,
    )


def test_columns_say_what_the_rows_say(write_run: WriteRun) -> None:
    run = shearline.record.open(write_run())
    table = run.table()
    for i, row in enumerate(run.trials()):
        for name in ("trial", "episode", "outcome", "success", "cost", "seed", "wall_s", "why"):
            assert table[name][i] == row[name]
        for name, value in row["theta"].items():
            assert table[f"theta.{name}"][i] == value
        for name, value in row["extras"].items():
            assert table[f"extras.{name}"][i] == value
        assert table.theta[i].tolist() == list(row["theta"].values())


def test_parameters_and_times_have_their_units(write_run: WriteRun) -> None:
    table = shearline.record.open(write_run()).table()
    assert table.units["theta.ins_push"] == "N"
    assert table.units["theta.ins_k_rot"] == "N m/rad"
    assert (table.units["wall_s"], table.units["cost"]) == ("s", "")
    assert set(table.units) == set(table)


@given(
    st.lists(
        st.tuples(
            st.sampled_from([*list(OutcomeKind), None]),
            st.lists(st.floats(allow_nan=False), min_size=1, max_size=4),
            st.dictionaries(st.sampled_from("abc"), st.floats(allow_nan=False)),
        ),
        max_size=8,
    )
)
def test_every_column_is_as_long_as_there_are_trials(
    rows: list[tuple[OutcomeKind | None, list[float], dict[str, float]]],
) -> None:
    outcomes = [counted(i, kind, theta, **extras) for i, (kind, theta, extras) in enumerate(rows)]
    table = table_of(outcomes, ["x", "y"], ["m", ""])
    assert {len(values) for values in table.values()} == {len(rows)}
    assert table.theta.shape == (len(rows), 2)
    for outcome, cost in zip(outcomes, table["cost"], strict=True):
        assert math.isnan(cost) == (outcome.kind is None)
    for name in "abc":
        said = [outcome.extras.get(name, math.nan) for outcome in outcomes]
        if f"extras.{name}" in table:
            np.testing.assert_array_equal(table[f"extras.{name}"], said)


def test_a_run_without_trials_is_an_empty_table(tmp_path: Path) -> None:
    table = shearline.record.open(tmp_path).table()
    assert len(table["trial"]) == 0
    assert table.theta.shape == (0, 0)


def test_the_trace_of_one_trial_is_columns_with_units(write_run: WriteRun) -> None:
    run = shearline.record.open(write_run())
    trace = run.trace(3)
    assert trace.trial == 3
    assert trace["depth"].shape == trace["t_s"].shape == trace.t_s.shape
    assert (trace.unit("depth"), trace.unit("t_s")) == ("m", "s")
    with pytest.raises(RecordError, match="trial 99 has no trace on this record: 8 trials"):
        run.trace(99)
