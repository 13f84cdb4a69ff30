"""Results survive a crash at any byte, and are never counted twice."""

from __future__ import annotations

import os
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.protocol.errors import RecordError
from shearline.studies.repeat import Job, Placement, Repeat
from shearline.studies.store import Store


def repeat(seed: int, *, run: str = "batch-0001", best: float = 1.0) -> Repeat:
    return Repeat(
        job=Job("sphere", Placement.SHIFTED, 5, "lhs", seed),
        best=[2.0, best],
        mean=[3.0],
        learner_s=0.1,
        versions={"shearline": "0.1.0"},
        code="0123456789ab",
        run=run,
        trial=seed,
        evaluator="evaluator-0",
    )


def test_what_was_added_is_there_for_the_next_process(tmp_path: Path) -> None:
    path = tmp_path / "study" / "repeats.jsonl"
    with Store(path) as store:
        assert store.add([repeat(0), repeat(1)]) == [repeat(0), repeat(1)]
    with Store(path) as store:
        assert list(store) == [repeat(0), repeat(1)]
        assert repeat(1).job in store
        assert repeat(2).job not in store


def test_the_same_trial_is_taken_over_once(tmp_path: Path) -> None:
    with Store(tmp_path / "repeats.jsonl") as store:
        store.add([repeat(0)])
        assert store.add([repeat(0), repeat(1)]) == [repeat(1)]
    assert len((tmp_path / "repeats.jsonl").read_text().splitlines()) == 2


def test_of_two_repeats_of_one_job_the_later_counts(tmp_path: Path) -> None:
    path = tmp_path / "repeats.jsonl"
    with Store(path) as store:
        store.add([repeat(0), repeat(0, run="batch-0002", best=0.5)])
    with Store(path) as store:
        assert store[repeat(0).job].best == [2.0, 0.5]


@settings(max_examples=20)  # each waits for the disk
@given(cut=st.integers(min_value=0), seeds=st.integers(1, 4))
def test_a_file_cut_anywhere_keeps_its_whole_lines_and_goes_on(
    tmp_path_factory: pytest.TempPathFactory, cut: int, seeds: int
) -> None:
    path = tmp_path_factory.mktemp("cut") / "repeats.jsonl"
    with Store(path) as store:
        store.add([repeat(seed) for seed in range(seeds)])
    data = path.read_bytes()[: cut % (path.stat().st_size + 1)]
    path.write_bytes(data)
    with Store(path) as store:
        assert len(list(store)) == data.count(b"\n")
        store.add([repeat(9)])
    with Store(path) as store:
        assert [one.job.seed for one in store] == [*range(data.count(b"\n")), 9]


def test_a_disk_that_is_full_leaves_no_half_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "repeats.jsonl"
    write = os.write

    def full(fd: int, data: bytes) -> int:
        if len(data) > 20:
            return write(fd, data[:20])
        raise OSError(28, "No space left on device")

    with Store(path) as store:
        store.add([repeat(0)])
        whole = path.read_bytes()
        monkeypatch.setattr(os, "write", lambda fd, data: full(fd, data[:30]))
        with pytest.raises(RecordError, match="No space left"):
            store.add([repeat(1)])
        assert path.read_bytes() == whole
        assert repeat(1).job not in store


def test_two_studies_do_not_share_a_folder(tmp_path: Path) -> None:
    path = tmp_path / "repeats.jsonl"
    with Store(path), pytest.raises(RecordError, match="another study"):
        Store(path)


def test_a_file_of_something_else_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "repeats.jsonl"
    path.write_text(msgspec.json.encode(repeat(0)).decode() + '\n{"task": 1}\n')
    with pytest.raises(RecordError, match="line 2"):
        Store(path)
    with pytest.raises(RecordError, match="line 2"):  # and it was let go of
        Store(path)


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordError, match="cannot use the results"):
        Store(tmp_path / "file" / "repeats.jsonl")
