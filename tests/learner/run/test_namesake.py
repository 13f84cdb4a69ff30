"""Two learners of one name meet at a router: the second is refused while the first is there."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from shearline.learner.run import namesake
from shearline.learner.run.namesake import refuse_namesake
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import ConfigError
from shearline.protocol.keys import Keys
from shearline.protocol.link import Link, open_router

KEYS = Keys("r")


@pytest.fixture
def hub() -> Iterator[str]:
    """Return the endpoint of a router that stands between."""
    endpoint = free_endpoint()
    with open_router(endpoint):
        yield endpoint


def behind(hub: str) -> Link:
    """Return a learner's session that goes through a router."""
    return open_router(free_endpoint(), settings={"connect/endpoints": [hub]})


def test_a_second_learner_of_that_name_is_refused_and_a_third_of_another_is_not(
    hub: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(namesake, "BELIEF_S", 0.0)
    with behind(hub) as first, behind(hub) as second:
        first.announce(KEYS.live_learner(1))
        with pytest.raises(ConfigError, match="another learner leads a run called 'r'"):
            refuse_namesake(second, KEYS)
        refuse_namesake(second, Keys("s"))


def test_who_was_killed_is_no_namesake_of_its_next_life(hub: str) -> None:
    with behind(hub) as first:
        first.announce(KEYS.live_learner(1))
    with behind(hub) as second:
        refuse_namesake(second, KEYS)


def test_where_no_router_is_a_learner_begins_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(namesake, "CONNECT_S", 0.05)
    with behind(free_endpoint()) as alone:
        refuse_namesake(alone, KEYS)
