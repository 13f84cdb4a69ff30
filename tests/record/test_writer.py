"""The file: whole for every MCAP reader, readable while it grows, and never the run's problem."""

import itertools
import subprocess
import sys
import textwrap
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Bye, Message, Proposed, TraceData
from shearline.record.foxglove import Level
from shearline.record.head import config_of
from shearline.record.parts import parts
from shearline.record.reader import open_run
from shearline.record.topics import TOPICS
from shearline.record.writer import RESERVE_BYTES, RecordWriter

Messages = Callable[..., list[Message]]
SECOND_NS = 10**9
#: Later than the head of any record written by these tests.
LATER_NS = 4_000_000_000 * SECOND_NS


def read_plainly(path: Path) -> list[tuple[str, int, int, Any]]:
    """Read as someone would who has only the file: topic, log time, sequence, message."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [
            (channel.topic, message.log_time, message.sequence, decoded)
            for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False)
        ]


def proposed(trial: int) -> Proposed:
    return Proposed(trial=trial, episode=0, theta=[0.5, 1.5], seed=trial)


def test_the_plain_reader_decodes_every_message(
    write_run: Callable[..., Path], messages: Messages
) -> None:
    found = read_plainly(write_run() / "record.mcap")
    counts: defaultdict[str, int] = defaultdict(int)
    for topic, _, _, _ in found:
        counts[topic] += 1
    said = messages()
    for kind, topic_of in TOPICS.items():
        if topic_of.name != "/run":
            assert counts[topic_of.name] == sum(type(message) is kind for message in said)
    assert counts["/run"] == 1
    assert counts["/trial/tip"] == sum(isinstance(message, TraceData) for message in said)


def test_time_never_runs_backwards_on_a_channel_and_nothing_is_numbered_twice(
    run_dir: Path,
) -> None:
    with RecordWriter(run_dir, config_of("r", run_dir)) as writer:
        for trial, log_ns in enumerate((5, LATER_NS, 7, LATER_NS + 1)):
            writer.write(proposed(trial), log_ns=log_ns)
    found = [row for row in read_plainly(run_dir / "record.mcap") if row[0] == "/trial/proposed"]
    times = [log_ns for _, log_ns, _, _ in found]
    assert times == sorted(times)
    assert [sequence for _, _, sequence, _ in found] == [0, 1, 2, 3]
    assert [decoded.trial for _, _, _, decoded in found] == [0, 1, 2, 3]


def test_a_record_is_readable_while_it_is_written(run_dir: Path) -> None:
    with RecordWriter(run_dir, config_of("r", run_dir)) as writer:
        writer.write(proposed(1), log_ns=LATER_NS)
        assert not open_run(run_dir).proposed
        writer.tick(LATER_NS + SECOND_NS)
        run = open_run(run_dir)
    assert list(run.proposed) == [1]
    assert run.damage == []


def test_a_full_part_is_followed_by_the_next_and_nothing_is_lost(
    run_dir: Path, messages: Messages
) -> None:
    said = messages()
    clock = itertools.count(LATER_NS, SECOND_NS)
    with RecordWriter(run_dir, config_of("r", run_dir), part_bytes_max=100_000) as writer:
        for message in said:
            now_ns = next(clock)
            writer.write(message, log_ns=now_ns)
            writer.tick(now_ns)
    assert len(parts(run_dir)) > 1
    run = open_run(run_dir)
    assert run.damage == []
    assert len(run.outcomes) == len(run.traced()) == 8
    for path in parts(run_dir):
        assert read_plainly(path)[0][0] == "/run"


def test_a_record_goes_on_in_a_new_part(run_dir: Path) -> None:
    for trial in range(3):
        with RecordWriter(run_dir, config_of("r", run_dir)) as writer:
            writer.write(proposed(trial), log_ns=LATER_NS)
    assert [path.name for path in parts(run_dir)] == [
        "record.mcap",
        "record-1.mcap",
        "record-2.mcap",
    ]
    assert sorted(open_run(run_dir).proposed) == [0, 1, 2]


def test_a_message_without_a_topic_is_refused(run_dir: Path) -> None:
    with (
        RecordWriter(run_dir, config_of("r", run_dir)) as writer,
        pytest.raises(RecordError, match="Bye are not recorded"),
    ):
        writer.write(Bye(boot="a-boot-1"), log_ns=1)


def test_a_folder_that_cannot_be_written_is_one_clear_error(tmp_path: Path) -> None:
    missing = tmp_path / "missing"
    with pytest.raises(RecordError, match=r"cannot be begun in .*missing.*choose another folder"):
        RecordWriter(missing, config_of("r", tmp_path))


def test_the_room_kept_for_a_full_disk_is_given_back(run_dir: Path) -> None:
    with RecordWriter(run_dir, config_of("r", run_dir)):
        assert (run_dir / ".record-reserve").stat().st_size == RESERVE_BYTES
    assert sorted(path.name for path in run_dir.iterdir()) == ["record.mcap", "run.toml"]


def test_closing_twice_changes_nothing(run_dir: Path) -> None:
    writer = RecordWriter(run_dir, config_of("r", run_dir))
    writer.close()
    size = (run_dir / "record.mcap").stat().st_size
    writer.close()
    assert (run_dir / "record.mcap").stat().st_size == size


#: Fills the record under a limit on file size: a full disk as far as one file is concerned.
FILL = """
    import resource, sys
    from pathlib import Path
    from shearline.protocol.messages import Proposed
    from shearline.record.head import config_of
    from shearline.record.writer import RecordWriter

    folder, limit = Path(sys.argv[1]), int(sys.argv[2])
    writer = RecordWriter(folder, config_of("r", folder))
    if limit:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    import random
    trial = 0
    for trial in range(20_000):
        theta = [random.random() for _ in range(32)]
        writer.write(Proposed(trial=trial, episode=0, theta=theta, seed=trial), log_ns=trial)
        if trial % 50 == 0:
            writer.tick(trial * 10**9)
        if writer.stopped:
            break
    writer.close()
    print(trial)
"""


def fill(run_dir: Path, limit: int) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(FILL), str(run_dir), str(limit)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )


def test_a_full_disk_stops_the_record_with_one_sentence_and_raises_nothing(run_dir: Path) -> None:
    done = fill(run_dir, 200_000)
    sentences = done.stderr.strip().splitlines()
    assert len(sentences) == 1
    assert "recording stopped: File too large" in sentences[0]
    assert "the run goes on" in sentences[0]
    run = open_run(run_dir)
    # all but the last chunk or two are there, in order, and the file is whole or honestly torn
    assert 0 < len(run.proposed) <= int(done.stdout) + 1
    assert sorted(run.proposed) == list(range(len(run.proposed)))
    assert int(done.stdout) - len(run.proposed) <= 100


@pytest.mark.chaos
@pytest.mark.slow
def test_a_really_full_disk_leaves_a_whole_file_that_says_why(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no right to mount a small disk here")
    try:
        done = fill(disk, 0)
        assert "No space left on device" in done.stderr
        found = read_plainly(disk / "record.mcap")
        assert found[-1][0] == "/log"
        assert "No space left" in found[-1][3].message
        assert open_run(disk).damage == []
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_the_log_carries_the_recorders_words(run_dir: Path) -> None:
    with RecordWriter(run_dir, config_of("r", run_dir)) as writer:
        writer.log(Level.WARNING, "dropped 3 traces", log_ns=LATER_NS)
    (line,) = (row[3] for row in read_plainly(run_dir / "record.mcap") if row[0] == "/log")
    assert (line.level, line.message, line.name) == (3, "dropped 3 traces", "recorder")
