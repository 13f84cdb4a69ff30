"""What is on record is counted from summaries, and where these cannot tell, nothing is claimed."""

import fcntl
from collections.abc import Callable
from pathlib import Path

import pytest

from shearline.record.complete import complete
from shearline.record.reader import open_run
from shearline.record.tally import tally


def test_every_message_of_every_part_is_counted(write_run: Callable[..., Path]) -> None:
    run_dir = write_run()
    counted = tally(run_dir)
    run = open_run(run_dir)
    assert counted is not None
    assert counted["/trial/outcome"] == len(run.outcomes) == 8
    assert counted["/episode"] == len(run.episodes) == 2


def test_no_record_holds_nothing(tmp_path: Path) -> None:
    assert tally(tmp_path) == {}


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 0.99])
def test_a_part_that_was_cut_short_tells_nothing(
    write_run: Callable[..., Path], share: float
) -> None:
    run_dir = write_run()
    path = run_dir / "record.mcap"
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    assert tally(run_dir) is None
    complete(run_dir, [])
    assert tally(run_dir) is not None, "once it has an end again, it tells"


def test_a_part_that_is_being_written_tells_nothing(write_run: Callable[..., Path]) -> None:
    run_dir = write_run()
    with (run_dir / "record.mcap").open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert tally(run_dir) is None
