"""The recorder process: hears everything, harms nobody, survives being killed."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from msgspec.structs import replace

from shearline.protocol.codec import encode
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import LinkError
from shearline.protocol.keys import Keys
from shearline.protocol.link import Link, open_router
from shearline.protocol.messages import Counted, Message, Proposed, Status, TraceData
from shearline.record.reader import Run, open_run
from shearline.record.recorder import main, record_run
from shearline.record.seal import seal_all
from shearline.record.start import spawn

Messages = Callable[..., list[Message]]
KEYS = Keys("synthetic")


@contextmanager
def learner() -> Iterator[Link]:
    with open_router(free_endpoint()) as link:
        link.announce(KEYS.live_learner(1))
        yield link


def say(link: Link, said: list[Message]) -> None:
    for message in said:
        evaluator = "sim-0" if isinstance(message, TraceData) else ""
        link.publish(KEYS.obs(message, evaluator), encode(message))


@contextmanager
def recording(link: Link, run_dir: Path) -> Iterator[threading.Thread]:
    """Record in a thread of this process, from the moment that nothing is missed any more."""
    ready = threading.Event()
    thread = threading.Thread(
        target=record_run,
        args=(link.endpoint, "synthetic", run_dir),
        kwargs={"ready": ready.set, "silence_s": 20.0},
    )
    thread.start()
    assert ready.wait(20.0)
    yield thread
    thread.join(30.0)
    assert not thread.is_alive()


def log_lines(run: Run) -> list[str]:
    found = []
    for path in sorted(run.run_dir.glob("record*.mcap")):
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            rows = reader.iter_decoded_messages(topics=["/log"])
            found += [row.decoded_message.message for row in rows]
    return found


def wait_until(condition: Callable[[], bool], patience_s: float = 20.0) -> None:
    until_s = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < until_s
        os.sched_yield()


@contextmanager
def child(link: Link, run_dir: Path) -> Iterator[subprocess.Popen[str]]:
    process = spawn(link.endpoint, "synthetic", run_dir)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "recording\n"
        yield process
    finally:
        process.kill()
        process.wait()
        assert process.stdout is not None
        process.stdout.close()


def test_everything_an_observer_hears_is_on_record_when_the_run_ends(
    run_dir: Path, messages: Messages
) -> None:
    said = messages()
    with learner() as link, recording(link, run_dir):
        say(link, said)
    run = open_run(run_dir)
    assert run.damage == []
    assert run.outcomes == [message for message in said if isinstance(message, Counted)]
    assert list(run.proposed.values()) == [m for m in said if isinstance(m, Proposed)]
    assert len(run.traced()) == 8
    assert log_lines(run)[-1] == "the run has ended"


def test_what_is_not_a_message_is_refused_and_counted(run_dir: Path, messages: Messages) -> None:
    with learner() as link, recording(link, run_dir):
        for garbage in (b"", b"\xc1", b"\x81\xa4type\xa5hello"):
            link.publish(f"{KEYS.root}/obs/counted", garbage)
        say(link, messages(episodes=1))
    run = open_run(run_dir)
    assert len(run.outcomes) == 4
    assert sum("messages refused so far" in line for line in log_lines(run)) == 2  # 1st and 2nd


def test_without_a_learner_there_is_one_clear_error(
    run_dir: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(LinkError, match="nobody answers at"):
        record_run(free_endpoint(), "synthetic", run_dir, silence_s=0.2)
    assert not list(run_dir.glob("record*"))
    assert capsys.readouterr().out == ""


def test_the_program_refuses_what_it_does_not_know(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--connect", "tcp/127.0.0.1:1"])
    assert ended.value.code == 2
    assert "required" in capsys.readouterr().err


@pytest.mark.slow
def test_a_recorder_that_is_told_to_stop_ends_its_file(run_dir: Path, messages: Messages) -> None:
    said = [message for message in messages() if not isinstance(message, Status)]
    with learner() as link, child(link, run_dir) as process:
        say(link, said)
        process.send_signal(signal.SIGTERM)
        assert process.wait(20.0) == 0
    run = open_run(run_dir)
    assert run.damage == []
    assert len(run.outcomes) == 8
    assert log_lines(run)[-1] == "told to stop"


@pytest.mark.slow
def test_a_recorder_without_a_learner_exits_with_3(run_dir: Path) -> None:
    command = [sys.executable, "-m", "shearline.record.recorder", "--connect", free_endpoint()]
    done = subprocess.run(
        [*command, "--run", "r", "--out", str(run_dir), "--silence", "0.3"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 3
    assert "nobody answers" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.slow
def test_a_recorder_outlives_its_learner_only_for_a_moment(
    run_dir: Path, messages: Messages
) -> None:
    with learner() as link, child(link, run_dir) as process:
        say(link, messages(episodes=1)[:8])
        wait_until(lambda: bool(open_run(run_dir).proposed))
        link.close()
        assert process.wait(20.0) == 0
    assert log_lines(open_run(run_dir))[-1] == "the learner is gone"


@pytest.mark.chaos
@pytest.mark.slow
def test_a_killed_recorder_loses_at_most_what_the_last_second_brought(
    run_dir: Path, messages: Messages
) -> None:
    said = [message for message in messages() if not isinstance(message, Status)]
    with learner() as link, child(link, run_dir) as process:
        say(link, said[: len(said) // 2])
        written_s = time.monotonic()
        half = {m.trial for m in said[: len(said) // 2] if isinstance(m, Counted)}
        wait_until(lambda: {m.trial for m in open_run(run_dir).outcomes} >= half)
        assert time.monotonic() - written_s < 10.0
        say(link, said[len(said) // 2 :])
        process.kill()
        process.wait()
    run = open_run(run_dir)
    assert {outcome.trial for outcome in run.outcomes} >= half
    assert seal_all(run_dir) == 1
    assert open_run(run_dir).damage == []


@pytest.mark.chaos
@pytest.mark.slow
def test_a_killed_recorder_loses_at_most_a_second_of_traces(
    run_dir: Path, messages: Messages
) -> None:
    """Traces are said for three seconds, then the recorder is killed in mid-stream."""
    one = next(message for message in messages(hz=1000) if isinstance(message, TraceData))
    said_s: dict[int, float] = {}
    with learner() as link, child(link, run_dir) as process:
        start_s = time.monotonic()
        pause = threading.Event()
        while time.monotonic() < start_s + 3.0:
            number = len(said_s)
            say(link, [replace(one, trial=number)])
            said_s[number] = time.monotonic()
            pause.wait(0.02)  # the pace of a hall of simulators
        process.kill()
        killed_s = time.monotonic()
        process.wait()
    seal_all(run_dir)
    run = open_run(run_dir)
    kept = set(run.traced())
    lost_s = max((killed_s - at_s for n, at_s in said_s.items() if n not in kept), default=0.0)
    assert len(kept) > 0.5 * len(said_s)
    assert lost_s <= 1.0
    assert run.damage == []


@pytest.mark.chaos
@pytest.mark.slow
def test_a_frozen_recorder_slows_nobody(run_dir: Path, messages: Messages) -> None:
    """The learner's puts take no longer while the recorder is stopped, once its pipe is full."""
    said = messages(episodes=5)
    with learner() as link, child(link, run_dir) as process:
        running_s = _observe(link, said)
        process.send_signal(signal.SIGSTOP)
        _observe(link, said)
        frozen_s = _observe(link, said)
        process.send_signal(signal.SIGCONT)
    assert frozen_s < 3.0 * running_s + 0.05


def _observe(link: Link, said: list[Message]) -> float:
    keyed = [(KEYS.obs(message), encode(message)) for message in said]
    start_s = time.perf_counter()
    for key, payload in keyed:
        link.observe(key, payload)
    return time.perf_counter() - start_s
