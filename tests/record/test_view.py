"""The view is written without a screen, follows a live run, and is a picture of something."""

import errno
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import rerun as rr

from shearline.protocol.codec import encode
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import LinkError, RecordError
from shearline.protocol.keys import Keys
from shearline.protocol.link import open_router
from shearline.protocol.messages import Message, TraceData
from shearline.record import viewer
from shearline.record.drain import STUCK, Drain
from shearline.record.head import config_of
from shearline.record.picture import Picture
from shearline.record.reader import Trace, to_trace
from shearline.record.screenshot import screenshot
from shearline.record.view import APPLICATION, LIVE_BULK_BYTES, connected, follow, save, view
from shearline.record.writer import RecordWriter

Messages = Callable[..., list[Message]]
#: What one of the traces below comes to in the stream, roughly [bytes].
BYTES_DRAWN = 80_000


def rerun(*arguments: str) -> str:
    with viewer.quiet_environment() as environment:
        done = subprocess.run(
            [viewer.executable(), *arguments],
            capture_output=True,
            text=True,
            timeout=60,
            env=environment,
            check=True,
        )
    return done.stdout


@pytest.fixture
def saved(write_run: Callable[..., Path], tmp_path: Path) -> Path:
    path = tmp_path / "run.rrd"
    save(write_run(), path)
    return path


@pytest.mark.slow
def test_the_saved_view_is_a_sound_file_with_everything_people_tune_by(saved: Path) -> None:
    rerun("rrd", "verify", str(saved))
    listed = rerun("rrd", "print", "-vv", str(saved))
    for path in (
        "/success_rate",
        "/cost/success",
        "/cost/failure",
        "/cost/best",
        "/card",
        "/parameters/ins_push/success",
        "/charts/0/lines",
        "/scene/path",
        "/scene/forces",
        "/signals/depth",
        "/signals/tau_ext",
        "/phase",
        "/evaluators/sim-0",
    ):
        assert path in listed, path
    for timeline in ("trial", "played", "clock"):
        assert timeline in listed, timeline


@pytest.mark.slow
def test_rerun_opens_the_record_itself_field_by_field(
    write_run: Callable[..., Path], tmp_path: Path
) -> None:
    record = write_run() / "record.mcap"
    checked = rerun("mcap", "check", "--full", str(record))
    assert "/trial/outcome" in checked
    rerun("mcap", "convert", str(record), "-o", str(tmp_path / "plain.rrd"))
    listed = rerun("rrd", "print", "-vv", str(tmp_path / "plain.rrd"))
    assert "shearline.Counted:message" in listed
    assert '"cost": non-null Float64' in listed
    assert '"data": List(non-null Float32)' in listed
    assert "InstancePoses3D:translations" in listed


def test_a_run_without_traces_or_names_can_be_viewed(tmp_path: Path, messages: Messages) -> None:
    with RecordWriter(tmp_path, config_of("bare", tmp_path)) as writer:
        for log_ns, message in enumerate(messages()):
            if not isinstance(message, TraceData):
                writer.write(message, log_ns=log_ns)
    run = save(tmp_path, tmp_path / "bare.rrd")
    assert len(run.outcomes) == 8
    assert (tmp_path / "bare.rrd").stat().st_size > 1000


def test_an_empty_run_can_be_viewed(tmp_path: Path) -> None:
    save(tmp_path, tmp_path / "empty.rrd")
    assert (tmp_path / "empty.rrd").is_file()


def test_a_full_disk_is_one_clear_error(write_run: Callable[..., Path]) -> None:
    with pytest.raises(RecordError, match=r"cannot be written to /dev/full: .*No space left"):
        save(write_run(), "/dev/full")


def test_without_a_screen_the_way_out_is_said(
    write_run: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RecordError, match=r"no screen here: .*--save view.rrd"):
        view(write_run())


@pytest.mark.slow
def test_a_screen_that_is_not_there_is_one_clear_error(
    write_run: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":4711")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RecordError, match=r"could not open a window .*--save view.rrd"):
        view(write_run())


def test_a_missing_viewer_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(RecordError, match=r"install it with pip install"):
        viewer.executable()


def test_the_viewer_itself_says_that_its_statistics_are_off() -> None:
    before = dict(os.environ)
    config = json.loads(rerun("analytics", "config"))
    assert config["analytics_enabled"] is False
    assert os.environ == before


def test_the_viewer_reaches_no_network_but_this_machine() -> None:
    with viewer.quiet_environment() as environment:
        for name in ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"):
            assert environment[name] == environment[name.lower()] == viewer.NOWHERE
        port = int(viewer.NOWHERE.rsplit(":", 1)[1])
        with socket.socket() as probe:
            assert probe.connect_ex(("127.0.0.1", port)) == errno.ECONNREFUSED


@pytest.mark.slow
@pytest.mark.parametrize("at_hand", [False, True])
def test_a_live_view_follows_a_run_to_its_end(
    run_dir: Path, tmp_path: Path, messages: Messages, *, at_hand: bool
) -> None:
    said, keys = messages(), Keys("synthetic")
    stream = rr.RecordingStream(APPLICATION, recording_id="live")
    memory = stream.memory_recording()
    with open_router(free_endpoint()) as link:
        link.announce(keys.live_learner(1))
        ready = threading.Event()
        thread = threading.Thread(
            target=follow,
            args=(link.endpoint, stream),
            kwargs={
                "closed": lambda: False,
                "ready": ready.set,
                "run_dir": run_dir if at_hand else None,
            },
        )
        thread.start()
        assert ready.wait(20.0)
        for message in said:
            link.publish(keys.obs(message), encode(message))
        thread.join(20.0)
        assert not thread.is_alive()
    path = tmp_path / "live.rrd"
    path.write_bytes(memory.drain_as_bytes())
    listed = rerun("rrd", "print", str(path))
    assert "/success_rate" in listed
    assert "/scene/path" in listed


def test_there_is_nothing_to_follow_without_a_learner() -> None:
    stream = rr.RecordingStream(APPLICATION, recording_id="nobody")
    with pytest.raises(LinkError, match="nobody answers"):
        follow(free_endpoint(), stream, closed=lambda: False, timeout_s=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("pages", [(), ("best", "failure")], ids=["run", "two trials"])
def test_the_picture_shows_curves_and_not_an_empty_window(
    pages: tuple[str, ...], write_run: Callable[..., Path], tmp_path: Path
) -> None:
    full = tmp_path / "full.png"
    try:
        screenshot(write_run(), full, trial=3, pages=pages, at_s=0.5)
    except RecordError as error:
        pytest.skip(str(error))
    # curves, text and a scene do not compress to what an empty dark window does
    assert full.stat().st_size > 60_000


def test_trials_that_were_asked_for_have_a_page_of_their_own(
    write_run: Callable[..., Path], tmp_path: Path
) -> None:
    path = tmp_path / "run.rrd"
    save(write_run(), path, trials=("best", "failure"))
    listed = rerun("rrd", "print", "-vv", str(path))
    for root in ("/a", "/b"):
        for entity in ("card", "phase", "signals/tau_ext", "scene/path", "scene/force"):
            assert f"{root}/{entity}" in listed, entity


def test_a_trial_that_is_not_there_is_one_clear_error(
    write_run: Callable[..., Path], tmp_path: Path
) -> None:
    with pytest.raises(RecordError, match=r"no trial '99' in this run: expected a number up to 7"):
        save(write_run(), tmp_path / "run.rrd", trials=("99",))


def draw_for(picture: Picture, drain: Drain, trace: Trace, times: int) -> float:
    """Draw one trace again and again, as a live view does; return what that took for good [MB]."""
    before = resident_mb()
    for _ in range(times):
        if drain.taken():
            picture.trace(trace)
            picture.flush()
    return resident_mb() - before


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def first_trace(messages: Messages) -> Trace:
    return to_trace(next(m for m in messages(hz=1000) if isinstance(m, TraceData)))


@contextmanager
def a_viewer() -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """A viewer without its window: what takes a stream and keeps it."""
    port = viewer.free_port()
    with viewer.started(["--serve-grpc"], port) as child:
        yield child, port


@pytest.mark.slow
@pytest.mark.chaos
def test_a_viewer_that_is_killed_blocks_nobody_and_fills_no_memory(messages: Messages) -> None:
    trace, drawn = first_trace(messages), 100
    with a_viewer() as (child, port):
        stream = connected(port)
        picture, drain = Picture(stream, None), Drain(stream, patience_s=0.2)
        draw_for(picture, drain, trace, 20)
        os.killpg(child.pid, signal.SIGKILL)
        grown_mb = draw_for(picture, drain, trace, drawn)  # it comes back: nobody waited
    assert grown_mb < 0.5 * drawn * BYTES_DRAWN / 1e6


@pytest.mark.slow
@pytest.mark.chaos
def test_a_viewer_that_is_stopped_fills_no_memory_and_gets_the_rest_once_it_goes_on(
    messages: Messages, capfd: pytest.CaptureFixture[str]
) -> None:
    trace = first_trace(messages)
    with a_viewer() as (child, port):
        stream = connected(port)
        picture, drain = Picture(stream, None), Drain(stream, patience_s=0.2)
        draw_for(picture, drain, trace, 20)
        assert drain.taken()
        os.killpg(child.pid, signal.SIGSTOP)
        # what is on its way fills some buffers; then further tries take no more
        draw_for(picture, drain, trace, 30)
        assert not drain.taken()
        fed_mb = draw_for(picture, drain, trace, 40)
        assert fed_mb < 0.2 * 40 * BYTES_DRAWN / 1e6
        os.killpg(child.pid, signal.SIGCONT)
        assert drain.wait(lambda: child.poll() is not None)
    assert capfd.readouterr().err.count(STUCK) == 1


@pytest.mark.slow
@pytest.mark.chaos
def test_a_live_view_of_a_stopped_viewer_holds_what_its_inbox_has_room_for(
    messages: Messages,
) -> None:
    said, keys, ended = messages(hz=1000), Keys("synthetic"), threading.Event()
    trace = next(message for message in said if isinstance(message, TraceData))
    with a_viewer() as (child, port), open_router(free_endpoint()) as link:
        link.announce(keys.live_learner(1))
        ready = threading.Event()
        thread = threading.Thread(
            target=follow,
            args=(link.endpoint, connected(port)),
            kwargs={"closed": ended.is_set, "ready": ready.set},
        )
        thread.start()
        assert ready.wait(20.0)
        os.killpg(child.pid, signal.SIGSTOP)
        key, payload = keys.obs(trace, "sim-0"), encode(trace)
        before_mb, n = resident_mb(), 4 * LIVE_BULK_BYTES // len(payload)
        for _ in range(n):
            link.publish(key, payload)
        grown_mb = resident_mb() - before_mb
        os.killpg(child.pid, signal.SIGCONT)
        link.publish(keys.obs(said[-1]), encode(said[-1]))
        thread.join(30.0)
        went_on = not thread.is_alive()
        ended.set()
        thread.join()
    assert went_on
    # the inbox, and what was on its way: not four inboxes full, nor what is drawn of them
    assert grown_mb < 2.5 * LIVE_BULK_BYTES / 1e6


@pytest.mark.slow
def test_with_its_command_the_viewer_itself_is_ended_even_if_it_is_stopped() -> None:
    with a_viewer() as (child, _):
        (proper,) = children(child.pid)
        ending = os.pidfd_open(proper)
        os.kill(proper, signal.SIGSTOP)
    assert ends(ending)
    assert not running(child.pid)


@pytest.mark.slow
def test_with_its_command_killed_the_viewer_itself_is_ended() -> None:
    with a_viewer() as (child, _):
        (proper,) = children(child.pid)
        ending = os.pidfd_open(proper)
        child.kill()
        child.wait()
    assert ends(ending)


def ends(pidfd: int) -> bool:
    """Wait until a process that is nobody's child here has ended."""
    with os.fdopen(pidfd):
        return bool(select.select([pidfd], [], [], 10.0)[0])


def children(pid: int) -> list[int]:
    text = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii")
    return [int(word) for word in text.split()]


def running(pid: int) -> bool:
    """Tell whether a process is more than a name that nobody has asked after yet."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    except FileNotFoundError:
        return False
    return stat.rsplit(") ", 1)[1][0] not in "ZX"
