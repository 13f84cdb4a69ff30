"""A record cut at any byte is read up to the cut, and once sealed is whole for everyone."""

import io
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Proposed
from shearline.record.frames import MAGIC, frames
from shearline.record.head import config_of
from shearline.record.reader import open_run
from shearline.record.seal import seal, seal_all
from shearline.record.writer import RecordWriter

TRIALS = 30


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A record of many small chunks."""
    folder = tmp_path_factory.mktemp("whole")
    with RecordWriter(folder, config_of("r", folder)) as writer:
        for trial in range(TRIALS):
            now_ns = 4_000_000_000_000_000_000 + trial * 10**9
            message = Proposed(trial=trial, episode=0, theta=[0.1 * trial], seed=trial)
            writer.write(message, log_ns=now_ns)
            writer.tick(now_ns)
    return folder / "record.mcap"


def plainly(path: Path) -> list[int]:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        found = list(reader.iter_decoded_messages())
        assert summary.statistics.message_count == len(found)
        return [row.decoded_message.trial for row in found if row.channel.topic != "/run"]


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None
)
@given(share=st.floats(0.0, 1.0))
def test_a_record_cut_anywhere_is_read_to_the_cut_and_sealed(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, share: float
) -> None:
    folder = tmp_path_factory.mktemp("cut")
    path = folder / "record.mcap"
    content = whole.read_bytes()
    path.write_bytes(content[: int(share * (len(content) - 1))])
    before = open_run(folder)
    assert sorted(before.proposed) == list(range(len(before.proposed)))
    # cut behind its last message, a part has lost nothing worth a word
    assert len(before.damage) == 1 or (len(before.proposed) == TRIALS and not before.damage)
    assert seal(path)
    after = open_run(folder)
    assert sorted(after.proposed) == sorted(before.proposed)
    assert after.damage == []
    if path.exists():
        assert plainly(path) == sorted(before.proposed)
        assert not seal(path)


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None
)
@given(place=st.floats(0.0, 1.0, exclude_max=True), bit=st.integers(0, 7))
def test_one_flipped_bit_costs_at_most_what_it_hit_and_is_said(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, place: float, bit: int
) -> None:
    folder = tmp_path_factory.mktemp("flipped")
    damaged = bytearray(whole.read_bytes())
    damaged[int(place * len(damaged))] ^= 1 << bit
    (folder / "record.mcap").write_bytes(damaged)
    run = open_run(folder)  # whatever was hit, it opens
    for trial, message in run.proposed.items():
        assert message.theta == [0.1 * trial]
    assert run.damage or len(run.proposed) == TRIALS


@pytest.mark.parametrize("opcode", [Opcode.DATA_END, Opcode.FOOTER])
def test_a_chunk_that_poses_as_the_end_is_said(whole: Path, tmp_path: Path, opcode: Opcode) -> None:
    damaged = bytearray(whole.read_bytes())
    chunks = [frame for frame in frames(io.BytesIO(damaged)) if frame.opcode == Opcode.CHUNK]
    damaged[chunks[5].offset] = opcode
    (tmp_path / "record.mcap").write_bytes(damaged)
    assert open_run(tmp_path).damage


def test_a_whole_part_is_left_alone(whole: Path, tmp_path: Path) -> None:
    path = tmp_path / "record.mcap"
    path.write_bytes(whole.read_bytes())
    assert not seal(path)
    assert path.read_bytes() == whole.read_bytes()


def test_a_part_that_is_being_written_is_left_alone(run_dir: Path) -> None:
    with RecordWriter(run_dir, config_of("r", run_dir)):
        before = (run_dir / "record.mcap").read_bytes()
        assert seal_all(run_dir) == 0
        assert (run_dir / "record.mcap").read_bytes() == before


def test_a_part_that_holds_nothing_is_removed(tmp_path: Path) -> None:
    (tmp_path / "record.mcap").write_bytes(MAGIC)
    assert seal_all(tmp_path) == 1
    assert not list(tmp_path.iterdir())


def test_a_damaged_chunk_is_left_out_and_what_follows_is_kept(whole: Path, tmp_path: Path) -> None:
    damaged = bytearray(whole.read_bytes())
    chunks = [frame for frame in frames(io.BytesIO(damaged)) if frame.opcode == Opcode.CHUNK]
    damaged[chunks[5].end - 3] ^= 0x10
    (tmp_path / "record.mcap").write_bytes(damaged)
    run = open_run(tmp_path)
    assert len(run.proposed) == TRIALS - 1
    (sentence,) = run.damage
    assert f"the chunk at byte {chunks[5].offset} is damaged" in sentence


def test_sealing_keeps_what_follows_a_damaged_chunk(whole: Path, tmp_path: Path) -> None:
    damaged = bytearray(whole.read_bytes())
    chunks = [frame for frame in frames(io.BytesIO(damaged)) if frame.opcode == Opcode.CHUNK]
    damaged[chunks[5].end - 3] ^= 0x10
    path = tmp_path / "record.mcap"
    path.write_bytes(damaged[: chunks[20].offset + 50])
    assert seal(path)
    # chunk 0 is the head, so 19 proposals stood before the cut and one of them was hit
    assert sorted(open_run(tmp_path).proposed) == [n for n in range(19) if n != 4]
    assert plainly(path) == [n for n in range(19) if n != 4]


def test_what_is_no_mcap_file_says_so() -> None:
    with pytest.raises(RecordError, match="does not begin like an MCAP file"):
        list(frames(io.BytesIO(b"hello, world")))
