"""Goal: whoever floods fills a share of the queue and nothing of anyone else's.

Method: a session speaks to itself, so that what is said waits when the next line runs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from shearline.learner.run import inbox
from shearline.learner.run.doorman import Doorman
from shearline.learner.run.inbox import Inbox
from shearline.protocol.codec import CONTROL_BYTES_MAX
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.intake import Arrival, Presence
from shearline.protocol.keys import Keys
from shearline.protocol.link import Link, open_router

KEYS = Keys("r")
FLOOD = 10 * inbox.SHARE_MAX


class Strict(Doorman):
    """Knows nobody but whoever says ``please``."""

    def __init__(self) -> None:
        """Have no desk to look at."""

    def knows(self, arrival: Arrival) -> bool:
        return b"please" in arrival.payload

    def minds(self, presence: Presence) -> bool:
        return presence.key.endswith("please")


@dataclass
class House:
    """An inbox and the session that fills it."""

    box: Inbox
    link: Link

    def say(self, name: str, topic: str, payload: bytes = b"please", times: int = 1) -> None:
        for _ in range(times):
            self.link._session.put(f"{KEYS.root}/ev/{name}/{topic}", payload)

    def take_all(self) -> list[list[object]]:
        """Return all steps until nothing is left."""
        steps: list[list[object]] = []
        while True:
            self.box.put("look")  # else it would wait when nothing is left
            steps.append(self.box.take())
            if len(steps[-1]) < inbox.STEP_ITEMS_MAX:
                return steps

    def arrivals(self) -> list[Arrival]:
        return [item for step in self.take_all() for item in step if isinstance(item, Arrival)]


@pytest.fixture
def link() -> Iterator[Link]:
    with open_router(free_endpoint()) as router:
        yield router


@pytest.fixture
def house(link: Link) -> House:
    return House(Inbox(link.intake(KEYS.from_evaluators(), KEYS.wake())), link)


@pytest.fixture
def strict(link: Link) -> House:
    return House(Inbox(link.intake(KEYS.from_evaluators(), KEYS.wake()), Strict()), link)


def test_where_there_is_room_nobody_is_asked_who_it_is(strict: House) -> None:
    strict.say("a", "result", b"let me in", inbox.STEP_ITEMS_MAX // 2)
    assert len(strict.arrivals()) == inbox.STEP_ITEMS_MAX // 2
    assert strict.box.dropped == 0


def test_nothing_is_lost_of_what_honest_evaluators_say_together(strict: House) -> None:
    said = [f"e{n}" for n in range(8 * inbox.STEP_ITEMS_MAX)]
    for name in said:
        strict.say(name, "result")
    steps = strict.take_all()
    assert max(map(len, steps)) <= inbox.STEP_ITEMS_MAX
    heard = [item for step in steps for item in step if isinstance(item, Arrival)]
    assert [item.key.split("/")[-2] for item in heard] == said
    assert strict.box.dropped == 0


def test_who_floods_fills_a_share_and_the_others_wait_behind_that_alone(house: House) -> None:
    house.say("loud", "credit", times=FLOOD)
    house.say("calm", "result")
    taken = house.arrivals()
    assert len(taken) <= inbox.STEP_ITEMS_MAX + inbox.SHARE_MAX + 1
    assert taken[-1].key.endswith("ev/calm/result")
    assert house.box.dropped == FLOOD + 1 - len(taken)


def test_a_flood_of_one_topic_leaves_the_others_of_that_evaluator_alone(house: House) -> None:
    house.say("crowd", "renew", times=inbox.STEP_ITEMS_MAX)
    house.say("a", "credit", times=FLOOD // 2)
    house.say("a", "hello", times=FLOOD // 2)
    for said in ("renew", "result", "bye"):
        house.say("a", said)
    topics = [item.key.rpartition("/")[2] for item in house.arrivals() if "/a/" in item.key]
    assert topics.count("credit") == inbox.SHARE_MAX
    assert topics.count("hello") == inbox.HELLOS_MAX
    assert topics[-3:] == ["renew", "result", "bye"]


def test_in_a_crowd_the_unknown_take_nothing_from_the_share_of_those_they_speak_for(
    strict: House,
) -> None:
    strict.say("a", "result", b"let me in", FLOOD)
    strict.say("a", "result")
    taken = strict.arrivals()
    assert taken[-1].payload == b"please"
    assert len(taken) <= inbox.STEP_ITEMS_MAX + 1


def test_once_there_is_room_again_who_flooded_is_heard(house: House) -> None:
    house.say("loud", "credit", times=FLOOD)
    assert house.arrivals()
    house.say("loud", "credit")
    assert len(house.arrivals()) == 1


def test_what_is_larger_than_any_message_is_never_taken(house: House) -> None:
    house.say("a", "result", bytes(CONTROL_BYTES_MAX + 1))
    house.say("a", "result")
    assert [item.payload for item in house.arrivals()] == [b"please"]
    assert house.box.dropped == 1


def test_lives_that_nobody_minds_are_dropped_when_too_many_wait(strict: House) -> None:
    for number in range(inbox.BACKLOG):
        strict.box.put(number)
    for boot in ("nobody", "please"):
        strict.box.put(Presence(f"r/live/ev/a/{boot}", alive=False))
    assert strict.box.dropped == 1
    items = [item for step in strict.take_all() for item in step]
    assert [item for item in items if isinstance(item, int)] == list(range(inbox.BACKLOG))
    assert Presence("r/live/ev/a/please", alive=False) in items


def test_keys_are_counted_anew_rather_than_without_bound(
    house: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inbox, "KEYS_MAX", 10)
    for name in range(8 * inbox.STEP_ITEMS_MAX):
        house.say(f"e{name}", "credit")
    step: list[object] = ["the first"] * inbox.STEP_ITEMS_MAX
    while len(step) == inbox.STEP_ITEMS_MAX:
        house.box.put("look")
        step = house.box.take()
        assert len(house.box._shares) <= 10
