"""Finding a learner: by its liveliness, the newest first, and for no longer than asked for."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from shearline.protocol.discovery import discover
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import LinkError
from shearline.protocol.keys import Keys
from shearline.protocol.link import Link, open_client, open_router

pytest.importorskip("zenoh")

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


def test_a_learner_is_discovered_once_it_announces_itself(router: Link, client: Link) -> None:
    with pytest.raises(LinkError, match=r"no learner is alive there within 0.05 s"):
        discover(client, 0.05)
    router.announce(KEYS.live_learner(7))
    assert discover(client, WAIT_S) == ("run-1", 7)
    router.announce(KEYS.live_learner(8))
    while discover(client, WAIT_S) != ("run-1", 8):
        pass


def test_a_learner_that_one_has_done_with_is_not_found_again(router: Link, client: Link) -> None:
    router.announce(KEYS.live_learner(7))
    assert discover(client, WAIT_S) == ("run-1", 7)
    with pytest.raises(LinkError, match="no learner is alive"):
        discover(client, 0.05, besides={("run-1", 7)})


def test_waiting_for_a_learner_can_be_called_off(client: Link) -> None:
    with pytest.raises(LinkError, match="stopped waiting"):
        discover(client, None, cancelled=lambda: True)
