"""Sessions: what they admit, how they fail, and that they always end."""

import os
import signal
import socket
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import pytest

from shearline.protocol import link as link_module
from shearline.protocol.codec import BULK_BYTES_MAX, CONTROL_BYTES_MAX
from shearline.protocol.discovery import discover
from shearline.protocol.endpoints import check_endpoint, free_endpoint
from shearline.protocol.errors import LinkError
from shearline.protocol.intake import Arrival, Presence
from shearline.protocol.keys import ANY_LEARNER, Keys
from shearline.protocol.link import Link, open_client, open_router

zenoh = pytest.importorskip("zenoh")

KEYS = Keys("run-1")
WAIT_S = 5.0


@pytest.fixture
def router() -> Iterator[Link]:
    with open_router(free_endpoint()) as link:
        yield link


@pytest.fixture
def client(router: Link) -> Iterator[Link]:
    with open_client(router.endpoint) as link:
        yield link


def _listening() -> set[tuple[str, int]]:
    """Addresses on which this process listens, from the kernel's own table."""
    inodes = {str(f.readlink()) for f in Path("/proc/self/fd").iterdir() if f.is_symlink()}
    rows = [
        row.split()
        for table in ("tcp", "tcp6", "udp", "udp6")
        for row in Path("/proc/net", table).read_text(encoding="ascii").splitlines()[1:]
    ]
    local = {row[1] for row in rows if f"socket:[{row[9]}]" in inodes and row[3] in {"0A", "07"}}
    return {(address.split(":")[0], int(address.split(":")[1], 16)) for address in local}


@pytest.mark.parametrize("path", link_module._COMMON)
def test_every_common_setting_is_one_that_zenoh_has(path: str) -> None:
    zenoh.Config().get_json(path)


def test_one_thread_receives_unless_the_environment_says_otherwise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("ZENOH_RUNTIME", raising=False)
    open_router(free_endpoint()).close()
    assert "rx: (worker_threads: 1)" in os.environ["ZENOH_RUNTIME"]
    assert "app: (handover: rx)" in os.environ["ZENOH_RUNTIME"]
    monkeypatch.setenv("ZENOH_RUNTIME", "(rx: (worker_threads: 3))")
    open_router(free_endpoint()).close()
    assert os.environ["ZENOH_RUNTIME"] == "(rx: (worker_threads: 3))"


def test_a_setting_that_zenoh_does_not_have_is_refused() -> None:
    with pytest.raises(LinkError, match="cannot listen"):
        open_router(free_endpoint(), settings={"transport/nonsense": 1})
    with pytest.raises(LinkError, match="cannot connect"):
        open_client(free_endpoint(), settings={"transport/nonsense": 1})


def test_a_router_listens_where_it_was_told_and_a_client_nowhere() -> None:
    before = _listening()
    endpoint = free_endpoint()
    with open_router(endpoint), open_client(endpoint):
        assert _listening() - before == {("0100007F", int(endpoint.rsplit(":")[-1]))}
    assert not _listening() - before


def test_bytes_pass_in_both_directions_and_in_order(router: Link, client: Link) -> None:
    at_router: SimpleQueue[Any] = SimpleQueue()
    at_client: SimpleQueue[Any] = SimpleQueue()
    router.subscribe(f"{KEYS.root}/ev/*/result", at_router)
    client.subscribe(f"{KEYS.root}/ev/lab/trial", at_client)
    _until_heard(client, at_router, f"{KEYS.root}/ev/lab/result")
    _until_heard(router, at_client, f"{KEYS.root}/ev/lab/trial")
    for i in range(200):
        client.publish(f"{KEYS.root}/ev/lab/result", b"%d" % i)
        router.publish(f"{KEYS.root}/ev/lab/trial", b"%d" % i)
    for inbox in (at_router, at_client):
        assert [inbox.get(timeout=WAIT_S).payload for _ in range(200)] == [
            b"%d" % i for i in range(200)
        ]


def _until_heard(sender: Link, inbox: SimpleQueue[Any], key: str) -> None:
    """Publish until a fresh subscription is known at the sender, then empty the inbox."""
    while True:
        sender.publish(key, b"")
        try:
            inbox.get(timeout=0.02)
        except Empty:
            continue
        while not inbox.empty():
            inbox.get()
        return


def test_one_evaluator_does_not_hear_what_is_said_to_another(router: Link, client: Link) -> None:
    inbox: SimpleQueue[Any] = SimpleQueue()
    client.subscribe(f"{KEYS.root}/ev/lab/trial", inbox)
    _until_heard(router, inbox, f"{KEYS.root}/ev/lab/trial")
    router.publish(f"{KEYS.root}/ev/other/trial", b"not yours")
    router.publish(f"{KEYS.root}/ev/lab/trial", b"yours")
    assert inbox.get(timeout=WAIT_S) == Arrival(f"{KEYS.root}/ev/lab/trial", b"yours")


def test_nobody_hears_himself(router: Link, client: Link) -> None:
    for link in (router, client):
        inbox: SimpleQueue[Any] = SimpleQueue()
        other = client if link is router else router
        link.subscribe(f"{KEYS.root}/ev/*/*", inbox)
        _until_heard(other, inbox, f"{KEYS.root}/ev/lab/ack")
        link.publish(f"{KEYS.root}/ev/lab/ack", b"own")
        other.publish(f"{KEYS.root}/ev/lab/ack", b"theirs")
        assert inbox.get(timeout=WAIT_S).payload == b"theirs"
        assert inbox.empty()


def test_observers_lose_nothing_while_they_keep_up(router: Link, client: Link) -> None:
    inbox: SimpleQueue[Any] = SimpleQueue()
    key = f"{KEYS.root}/obs/trace/lab"
    router.subscribe(key, inbox)
    _until_heard(client, inbox, key)
    for size in (10, 10_000, 300_000, 10):
        client.observe(key, bytes(size))
        assert len(inbox.get(timeout=WAIT_S).payload) == size


def test_a_message_beyond_the_limit_vanishes_and_the_link_stays(router: Link, client: Link) -> None:
    inbox: SimpleQueue[Any] = SimpleQueue()
    key = f"{KEYS.root}/obs/trace/lab"
    router.subscribe(key, inbox)
    _until_heard(client, inbox, key)
    client.publish(key, bytes(2 * BULK_BYTES_MAX + 1000))
    client.publish(key, b"small")
    assert inbox.get(timeout=WAIT_S).payload == b"small"


def test_what_is_larger_than_any_control_message_reaches_no_learner(
    router: Link, client: Link
) -> None:
    inbox: SimpleQueue[Any] = SimpleQueue()
    key = f"{KEYS.root}/ev/lab/result"
    router.subscribe(key, inbox)
    _until_heard(client, inbox, key)
    for size in (CONTROL_BYTES_MAX + 1, CONTROL_BYTES_MAX, BULK_BYTES_MAX):
        client.publish(key, bytes(size))
    client.publish(key, b"last")
    heard = [len(inbox.get(timeout=WAIT_S).payload) for _ in range(2)]
    assert heard == [CONTROL_BYTES_MAX, len(b"last")]


def test_waiting_to_be_connected_can_be_called_off() -> None:
    with pytest.raises(LinkError, match="stopped waiting"):
        open_client(free_endpoint(), None, cancelled=lambda: True)


def test_presence_follows_the_session_that_announced_it(router: Link) -> None:
    inbox: SimpleQueue[Any] = SimpleQueue()
    router.watch(KEYS.live_evaluators(), inbox)
    key = KEYS.live_evaluator("lab", "boot-0001")
    with open_client(router.endpoint) as client:
        client.announce(key)
        assert inbox.get(timeout=WAIT_S) == Presence(key, alive=True)
    assert inbox.get(timeout=WAIT_S) == Presence(key, alive=False)


def test_a_client_finds_the_next_learner_by_itself() -> None:
    endpoint, seen = free_endpoint(), SimpleQueue[Any]()
    first = open_router(endpoint)
    first.announce(KEYS.live_learner(1))
    with open_client(endpoint) as client:
        client.watch(ANY_LEARNER, seen)
        inbox: SimpleQueue[Any] = SimpleQueue()
        client.subscribe(KEYS.all_cmd(), inbox)
        assert seen.get(timeout=WAIT_S) == Presence(KEYS.live_learner(1), alive=True)
        assert client.is_connected()
        first.close()
        assert seen.get(timeout=WAIT_S) == Presence(KEYS.live_learner(1), alive=False)
        end_s = time.monotonic() + WAIT_S
        while client.is_connected():  # known a moment after the token is
            assert time.monotonic() < end_s
        client.publish(KEYS.all_cmd(), b"lost without an error")
        with open_router(endpoint) as second:
            second.announce(KEYS.live_learner(2))
            assert seen.get(timeout=WAIT_S) == Presence(KEYS.live_learner(2), alive=True)
            _until_heard(second, inbox, KEYS.all_cmd())


def test_an_endpoint_that_is_taken_is_said_so(router: Link) -> None:
    with pytest.raises(LinkError, match="it is taken: choose another port"):
        open_router(router.endpoint)


def test_an_address_of_another_machine_cannot_be_listened_at() -> None:
    with pytest.raises(LinkError, match="not an address of this machine"):
        open_router("tcp/192.0.2.1:7447")  # TEST-NET-1, RFC 5737


def test_an_endpoint_where_nobody_is_is_said_so_in_time() -> None:
    endpoint = free_endpoint()
    start_s = time.monotonic()
    with pytest.raises(LinkError, match=rf"nobody answers at {endpoint} within 0.1 s"):
        open_client(endpoint, 0.1)
    assert time.monotonic() - start_s < 10 * 0.1


def test_a_host_that_does_not_exist_is_said_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*_: object) -> None:
        raise socket.gaierror

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(LinkError, match="cannot find the host"):
        open_client(free_endpoint(), 0.05)


@pytest.mark.parametrize(
    "endpoint",
    [
        "",
        "127.0.0.1:7447",
        "tcp/127.0.0.1",
        "tcp:h:1",
        "tcp/h:99999",
        "tcp/h:x",
        "smoke/h:1",
        "tcp/:1",
    ],
)
def test_a_malformed_endpoint_is_refused_with_an_example(endpoint: str) -> None:
    for attempt in (check_endpoint, open_router, open_client):
        with pytest.raises(LinkError, match="expected an endpoint such as"):
            attempt(endpoint)


@pytest.mark.parametrize(
    "endpoint", ["tcp/0.0.0.0:7447", "tcp/[::1]:7447", "tls/lab-pc.local:7447#name=x", "tcp/h:0"]
)
def test_a_well_formed_endpoint_passes(endpoint: str) -> None:
    assert check_endpoint(endpoint) == endpoint


def test_closing_twice_is_closing_once(router: Link) -> None:
    assert router.close()
    assert router.close()


_ROUTER = """
    import sys
    from shearline.protocol.link import open_router
    from shearline.protocol.keys import Keys
    link = open_router(sys.argv[1])
    link.announce(Keys("run-1").live_learner(1))
    link.subscribe("shearline/@v1/run-1/obs/**", __import__("queue").SimpleQueue())
    print("up", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def process() -> Iterator[tuple[subprocess.Popen[str], str]]:
    endpoint = free_endpoint()
    command = [sys.executable, "-c", textwrap.dedent(_ROUTER), endpoint]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "up\n"
        yield child, endpoint
        child.kill()


def test_two_processes_talk_and_one_that_forgets_to_close_still_exits(
    process: tuple[subprocess.Popen[str], str],
) -> None:
    child, endpoint = process
    with open_client(endpoint) as client:
        assert discover(client, WAIT_S) == ("run-1", 1)
        child.communicate(timeout=WAIT_S)
        assert child.returncode == 0


@pytest.mark.chaos
def test_a_frozen_peer_neither_blocks_the_sender_for_long_nor_hangs_its_close(
    process: tuple[subprocess.Popen[str], str],
) -> None:
    child, endpoint = process
    client = open_client(endpoint)
    discover(client, WAIT_S)
    child.send_signal(signal.SIGSTOP)
    try:
        start_s = time.monotonic()
        for _ in range(200):
            client.observe("shearline/@v1/run-1/obs/trace/lab", bytes(100_000))
        dropped_s = time.monotonic() - start_s
        for _ in range(100):
            client.publish("shearline/@v1/run-1/obs/status", bytes(100_000))
        blocked_s = time.monotonic() - start_s - dropped_s
        start_2_s = time.monotonic()
        for _ in range(200):
            client.publish("shearline/@v1/run-1/obs/status", bytes(1000), wait=False)
        assert time.monotonic() - start_2_s < 0.5
        client.close(timeout_s=0.2)
        assert dropped_s < 0.5
        assert blocked_s < 4.0
        assert time.monotonic() - start_s < 6.0
    finally:
        child.send_signal(signal.SIGCONT)
