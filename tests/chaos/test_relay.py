"""The relay passes bytes, and does to them what it is told and nothing else."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from chaos.relay import Relay, port_of

from shearline.protocol.endpoints import free_endpoint

pytestmark = pytest.mark.chaos

#: Only decides when a broken relay is given up [s].
PATIENCE_S = 20.0
#: How long nothing must come for it to be believed that nothing comes [s].
QUIET_S = 0.2


class Ends:
    """Both ends of one connection through a relay."""

    def __init__(self, server: socket.socket, relay: Relay) -> None:
        self.near = socket.create_connection(("127.0.0.1", port_of(relay.endpoint)), PATIENCE_S)
        self.far, _ = server.accept()
        self.far.settimeout(PATIENCE_S)
        # The far end may be there before the relay knows of it: wait for what passed through.
        self.near.sendall(b"?")
        assert self.far.recv(1) == b"?"

    def close(self) -> None:
        self.near.close()
        self.far.close()


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", port_of(free_endpoint()))) as server:
        server.settimeout(PATIENCE_S)
        yield server


@pytest.fixture
def relay(server: socket.socket, tmp_path: Path) -> Iterator[Relay]:
    target = f"tcp/127.0.0.1:{server.getsockname()[1]}"
    with Relay("relay", target, tmp_path / "relay.out") as relay:
        yield relay


@pytest.fixture
def ends(server: socket.socket, relay: Relay) -> Iterator[Ends]:
    with contextlib.closing(Ends(server, relay)) as ends:
        yield ends


def hears(end: socket.socket, count: int) -> bytes:
    heard = b""
    while len(heard) < count:
        chunk = end.recv(65_536)
        assert chunk, f"the connection ended after {heard!r}"
        heard += chunk
    return heard


def hears_nothing(end: socket.socket) -> bool:
    end.settimeout(QUIET_S)
    try:
        return not end.recv(1)
    except TimeoutError:
        return True
    finally:
        end.settimeout(PATIENCE_S)


def test_bytes_pass_in_both_directions_in_order(ends: Ends) -> None:
    much = bytes(range(256)) * 4000
    ends.near.sendall(much)
    assert hears(ends.far, len(much)) == much
    ends.far.sendall(b"and back")
    assert hears(ends.near, 8) == b"and back"


def test_delayed_bytes_come_in_order_and_not_before(relay: Relay, ends: Ends) -> None:
    relay.order("delay 0.3")
    began_s = time.monotonic()
    ends.near.sendall(b"late")
    relay.order("delay 0")
    ends.near.sendall(b"r")
    assert hears(ends.far, 5) == b"later"
    assert time.monotonic() - began_s >= 0.3


def test_a_frozen_connection_is_silent_and_loses_nothing(relay: Relay, ends: Ends) -> None:
    relay.order("freeze")
    ends.near.sendall(b"one")
    ends.far.sendall(b"two")
    assert hears_nothing(ends.far)
    assert hears_nothing(ends.near)
    relay.order("thaw")
    assert hears(ends.far, 3) == b"one"
    assert hears(ends.near, 3) == b"two"


def test_a_half_open_connection_is_silent_in_one_direction(relay: Relay, ends: Ends) -> None:
    relay.order("hush down")
    ends.near.sendall(b"up")
    assert hears(ends.far, 2) == b"up"
    ends.far.sendall(b"down")
    assert hears_nothing(ends.near)


def test_a_frozen_relay_does_not_even_tell_of_an_end(relay: Relay, ends: Ends) -> None:
    relay.order("freeze")
    ends.near.close()
    ends.far.settimeout(QUIET_S)
    with pytest.raises(TimeoutError):
        ends.far.recv(1)


def test_a_reset_is_one_and_the_next_connection_is_welcome(
    relay: Relay, ends: Ends, server: socket.socket
) -> None:
    relay.order("reset")
    with pytest.raises(ConnectionResetError):
        ends.near.recv(1)
    with contextlib.closing(Ends(server, relay)) as again:
        again.near.sendall(b"hello")
        assert hears(again.far, 5) == b"hello"


def test_a_cut_ends_connections_old_and_new_until_it_is_mended(
    relay: Relay, ends: Ends, server: socket.socket
) -> None:
    relay.order("cut")
    assert ends.near.recv(1) == b""
    with socket.create_connection(("127.0.0.1", port_of(relay.endpoint)), PATIENCE_S) as refused:
        assert refused.recv(1) == b""
    relay.order("mend")
    with contextlib.closing(Ends(server, relay)) as again:
        again.near.sendall(b"hello")
        assert hears(again.far, 5) == b"hello"


def test_an_order_that_is_none_ends_the_relay_with_its_reason(relay: Relay) -> None:
    with pytest.raises(AssertionError, match="no such order: storm"):
        relay.order("storm")
