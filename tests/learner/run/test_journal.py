"""The journal: what was appended is there, whatever happened to the file's end."""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.learner.dispatcher.entries import AttemptReturned, Entry, LearnerBooted, RunEnded
from shearline.learner.run.journal import MAGIC, Journal, read
from shearline.protocol.errors import RecordError

ENTRIES: list[Entry] = [
    LearnerBooted(at_s=1.0, epoch=1),
    AttemptReturned(at_s=2.0, stimulus=7, token="t" * 16),
    RunEnded(at_s=3.0, ok=False, why="no disk"),
]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "journal"


def filled(path: Path) -> bytes:
    """Write all entries; return the file."""
    with Journal(path) as journal:
        journal.append(ENTRIES)
    return path.read_bytes()


@pytest.mark.parametrize("durable", [False, True])
def test_what_was_appended_is_read_back_in_order(path: Path, durable: bool) -> None:  # noqa: FBT001 - a parameter
    with Journal(path, durable=durable) as journal:
        assert journal.entries == []
        journal.append(ENTRIES[:1], sync=True)
        journal.append(ENTRIES[1:])
        journal.append([])
        assert list(read(path)) == ENTRIES
    with Journal(path) as again:
        assert again.entries == ENTRIES
        assert again.torn_bytes == 0


def test_an_append_survives_kill_9_of_the_process(path: Path) -> None:
    program = f"""
import os, signal
from pathlib import Path
from shearline.learner.dispatcher.entries import LearnerBooted
from shearline.learner.run.journal import Journal
journal = Journal(Path({str(path)!r}))
for epoch in range(100):
    journal.append([LearnerBooted(at_s=0.0, epoch=epoch)])
os.kill(os.getpid(), signal.SIGKILL)
"""
    done = subprocess.run([sys.executable, "-c", program], check=False, timeout=60)
    assert done.returncode == -signal.SIGKILL
    assert [e.epoch for e in read(path) if isinstance(e, LearnerBooted)] == list(range(100))


@settings(deadline=None)  # it writes to disk
@given(cut=st.integers(0, 1000), flip=st.integers(0, 10_000))
def test_a_damaged_tail_is_cut_off_and_the_rest_goes_on(
    tmp_path_factory: pytest.TempPathFactory, cut: int, flip: int
) -> None:
    path = tmp_path_factory.mktemp("run") / "journal"
    whole = bytearray(filled(path))
    keep = len(whole) - cut % (len(whole) - len(MAGIC))
    damaged = whole[:keep]
    if flip % 2 and len(damaged) > len(MAGIC):
        place = len(MAGIC) + flip % (len(damaged) - len(MAGIC))
        damaged[place] ^= 0x40
    path.write_bytes(damaged)
    seen = list(read(path))
    assert seen == ENTRIES[: len(seen)]
    with Journal(path) as journal:
        assert journal.entries == seen
        assert (journal.torn_bytes > 0) == (
            len(seen) < 3 and _ends_within(path, bytes(damaged), seen)
        )
        journal.append(ENTRIES)
    assert list(read(path)) == [*seen, *ENTRIES]


def _ends_within(path: Path, damaged: bytes, seen: Sequence[Entry]) -> bool:
    """Tell whether the damaged file had more than the entries that were seen."""
    beside = path.with_name("beside")
    with Journal(beside) as journal:
        journal.append(seen)
    return len(beside.read_bytes()) < len(damaged)


@pytest.mark.parametrize("length", range(len(MAGIC)))
def test_a_journal_torn_in_its_first_bytes_begins_again(path: Path, length: int) -> None:
    path.write_bytes(MAGIC[:length])
    with Journal(path) as journal:
        assert journal.entries == []
        journal.append(ENTRIES)
    assert list(read(path)) == ENTRIES


def test_what_is_no_journal_is_left_alone(path: Path) -> None:
    path.write_bytes(b"a letter to a friend")
    with pytest.raises(RecordError, match="is not a journal of this version"):
        Journal(path)
    assert path.read_bytes() == b"a letter to a friend"
    with pytest.raises(RecordError, match="is not a journal"):
        list(read(path))


def test_an_entry_of_another_version_is_not_thrown_away(path: Path) -> None:
    class Foreign(Entry, frozen=True, kw_only=True, tag="of-the-future"):
        pass

    with Journal(path) as journal:
        journal.append([Foreign(at_s=1.0)])
    before = path.read_bytes()
    with pytest.raises(RecordError, match="does not know"):
        Journal(path)
    assert path.read_bytes() == before


def test_a_second_learner_on_the_same_folder_is_refused(path: Path) -> None:
    with Journal(path), pytest.raises(RecordError, match="another learner is running on"):
        Journal(path)
    Journal(path).close()


def test_closing_twice_does_no_harm(path: Path) -> None:
    journal = Journal(path)
    journal.close()
    journal.close()


def test_a_full_disk_is_one_sentence_and_leaves_the_journal_whole(path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with Journal(path) as journal:
        journal.append(ENTRIES)
        size = path.stat().st_size
        resource.setrlimit(resource.RLIMIT_FSIZE, (size + 20, hard))
        try:
            with pytest.raises(RecordError, match=r"cannot write the journal .*: make room"):
                journal.append(ENTRIES)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        assert path.stat().st_size == size
        journal.append(ENTRIES[:1])
    assert list(read(path)) == [*ENTRIES, ENTRIES[0]]


def test_a_missing_file_or_folder_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="cannot use the journal"):
        list(read(tmp_path / "nothing"))
    with pytest.raises(RecordError, match="cannot use the journal"):
        Journal(tmp_path / "nowhere" / "journal")
    with pytest.raises(RecordError, match="cannot use the journal"):
        Journal(tmp_path)


def test_no_file_descriptor_is_left_behind(path: Path) -> None:
    path.write_bytes(b"not a journal")
    before = len(list(Path("/proc/self/fd").iterdir()))
    for _ in range(5):
        with pytest.raises(RecordError):
            Journal(path)
    assert len(list(Path("/proc/self/fd").iterdir())) == before
