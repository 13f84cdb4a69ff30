"""After an interruption the record has again every outcome that the journal has, once."""

from collections.abc import Callable
from pathlib import Path

from shearline.protocol.messages import Counted, EpisodeClosed, Message
from shearline.record.complete import complete
from shearline.record.parts import parts
from shearline.record.reader import open_run

Messages = Callable[..., list[Message]]


def journal(said: list[Message]) -> list[Counted | EpisodeClosed]:
    return [message for message in said if isinstance(message, (Counted, EpisodeClosed))]


def test_what_the_record_missed_is_appended_and_the_torn_part_is_whole_again(
    write_run: Callable[..., Path], messages: Messages
) -> None:
    run_dir = write_run()
    path = run_dir / "record.mcap"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    torn = open_run(run_dir)
    assert len(torn.outcomes) < 8
    assert torn.damage
    truth = journal(messages())
    missing = complete(run_dir, truth)
    run = open_run(run_dir)
    assert run.outcomes == [message for message in truth if isinstance(message, Counted)]
    assert run.episodes == [message for message in truth if isinstance(message, EpisodeClosed)]
    assert missing == len(truth) - len(torn.outcomes) - len(torn.episodes)
    assert run.damage == []
    assert run.name == "synthetic"


def test_a_complete_record_is_left_as_it_is(
    write_run: Callable[..., Path], messages: Messages
) -> None:
    run_dir = write_run()
    before = {path: path.read_bytes() for path in parts(run_dir)}
    assert complete(run_dir, journal(messages())) == 0
    assert {path: path.read_bytes() for path in parts(run_dir)} == before


def test_completing_twice_adds_nothing(run_dir: Path, messages: Messages) -> None:
    truth = journal(messages())
    assert complete(run_dir, truth) == len(truth)
    assert complete(run_dir, truth) == 0
    assert len(open_run(run_dir).outcomes) == 8
