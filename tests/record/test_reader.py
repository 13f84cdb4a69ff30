"""A run folder read back: rows for programs, traces for eyes, damage in one sentence."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import shearline.record
from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Counted, Message, Status, TraceData, Wire
from shearline.record.head import config_of
from shearline.record.reader import open_run
from shearline.record.writer import RecordWriter

Messages = Callable[..., list[Message]]


def lost(trial: int) -> Counted:
    return Counted(
        trial=trial,
        episode=0,
        theta=[1.0, 2.0],
        kind=None,
        cost=0.0,
        seed=1,
        evaluator="sim-0",
        attempts=3,
        late=False,
        engine="",
        digest="",
        wall_s=0.0,
        why="3 attempts lost",
        extras={},
        at_s=1.0,
    )


def test_rows_say_everything_of_a_trial_by_name(
    write_run: Callable[..., Path], messages: Messages
) -> None:
    run = shearline.record.open(write_run())
    said = [message for message in messages() if isinstance(message, Counted)]
    rows = list(run.trials())
    assert [row["trial"] for row in rows] == list(range(8))
    for row, counted in zip(rows, said, strict=True):
        assert list(row["theta"].values()) == counted.theta
        assert list(row["theta"])[:2] == ["ins_push", "ins_speed"]
        assert row["success"] == (row["outcome"] == "success")
        assert (row["cost"], row["digest"]) == (counted.cost, counted.digest)
        assert json.loads(json.dumps(row)) == row


def test_a_lost_trial_has_no_cost_and_no_success(run_dir: Path) -> None:
    with RecordWriter(run_dir, config_of("r", run_dir)) as writer:
        writer.write(lost(0), log_ns=1)
    (row,) = open_run(run_dir).trials()
    assert (row["outcome"], row["cost"], row["success"]) == ("lost", None, False)


def test_an_outcome_that_is_on_record_twice_counts_once(run_dir: Path) -> None:
    for trials in ((1, 0), (0, 2)):
        with RecordWriter(run_dir, config_of("r", run_dir)) as writer:
            for trial in trials:
                writer.write(lost(trial), log_ns=1)
    assert [row["trial"] for row in open_run(run_dir).trials()] == [0, 1, 2]


def test_traces_come_back_as_columns_with_units(
    write_run: Callable[..., Path], messages: Messages
) -> None:
    run = open_run(write_run())
    said = [message for message in messages() if isinstance(message, TraceData)]
    assert run.traced() == [message.trial for message in said]
    for message in said:
        (trace,) = run.traces(message.trial)
        whole = np.frombuffer(message.data, "<f4").reshape(len(message.names), -1)
        assert np.array_equal(trace.t_s, whole[0])
        assert list(trace.columns) == message.names[1:]
        assert [unit for unit, _ in trace.columns.values()] == message.units[1:]
        for (_, values), row in zip(trace.columns.values(), whole[1:], strict=True):
            assert np.array_equal(values, row)
        assert trace.events == tuple(message.events)
    assert run.traces(999) == []
    assert [trace.token for trace in run.all_traces()] == [message.token for message in said]


def test_the_configuration_names_the_parameters(write_run: Callable[..., Path]) -> None:
    run = open_run(write_run())
    assert run.config is not None
    assert run.config.units == ["N", "m/s", "N", "Hz", "N m/rad"]
    assert (run.config.low[0], run.config.high[0]) == (0.0, 20.0)
    assert run.settings()["task"]["name"] == "keylock"
    assert run.name == "synthetic"


def test_without_a_configuration_parameters_are_numbered(tmp_path: Path) -> None:
    with RecordWriter(tmp_path, config_of("r", tmp_path)) as writer:
        writer.write(lost(0), log_ns=1)
    (row,) = open_run(tmp_path).trials()
    assert row["theta"] == {"x0": 1.0, "x1": 2.0}


def test_every_topic_can_be_read_in_order(write_run: Callable[..., Path]) -> None:
    run = open_run(write_run())
    wire = list(run.messages("/wire"))
    assert len(wire) == 8
    assert all(isinstance(message, Wire) for _, message in wire)
    assert [log_ns for log_ns, _ in wire] == sorted(log_ns for log_ns, _ in wire)
    *_, (_, last) = run.messages("/status")
    assert isinstance(last, Status)
    assert last.state == "ended"
    with pytest.raises(RecordError, match="no topic '/nothing': expected one of /episode"):
        next(run.messages("/nothing"))


def test_the_learners_models_and_episodes_are_there(write_run: Callable[..., Path]) -> None:
    run = open_run(write_run(episodes=3))
    assert [snapshot.episode for snapshot in run.snapshots] == [0, 1, 2]
    assert [episode.episode for episode in run.episodes] == [0, 1, 2]
    assert {state.evaluator for state in run.evaluators} == {"sim-0", "sim-1"}


def test_a_record_file_stands_for_its_folder(write_run: Callable[..., Path]) -> None:
    assert len(open_run(write_run() / "record.mcap").outcomes) == 8


def test_a_folder_without_a_record_is_an_empty_run(tmp_path: Path) -> None:
    run = open_run(tmp_path)
    assert (list(run.trials()), run.traced(), run.damage, run.name) == ([], [], [], "")
    assert run.settings() == {}


def test_a_folder_that_is_not_there_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match=r"expected a run folder, found nothing at .*nowhere"):
        open_run(tmp_path / "nowhere")
