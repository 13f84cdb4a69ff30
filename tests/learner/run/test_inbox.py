"""Goal: whoever floods fills a share of the queue and nothing of anyone else's."""

from __future__ import annotations

import pytest

from shearline.learner.run import inbox
from shearline.learner.run.doorman import Doorman
from shearline.learner.run.inbox import Inbox
from shearline.protocol.codec import CONTROL_BYTES_MAX
from shearline.protocol.link import Arrival, Presence


class Strict(Doorman):
    """Knows nobody but whoever says ``please``."""

    def __init__(self) -> None:
        """Have no desk to look at."""

    def knows(self, arrival: Arrival) -> bool:
        return b"please" in arrival.payload

    def minds(self, presence: Presence) -> bool:
        return presence.key.endswith("please")


def fill(box: Inbox) -> None:
    """Make a crowd."""
    for n in range(inbox.BACKLOG):
        box.put(n)


def test_a_flooded_inbox_drops_heartbeats_then_all_arrivals_but_nothing_of_ours(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(inbox, "BACKLOG", 0)
    monkeypatch.setattr(inbox, "HEARTBEATS_MAX", 3)
    monkeypatch.setattr(inbox, "ARRIVALS_MAX", 5)
    box = Inbox()
    for _ in range(10):
        box.put(Arrival("r/ev/a/renew", b""))
    assert box.qsize() == 3
    for _ in range(10):
        box.put(Arrival("r/ev/a/result", b""))
    assert box.qsize() == 5
    box.put(Presence("r/live/ev/a/boot", alive=False))
    box.put("ours")
    assert (box.qsize(), box.dropped) == (6, 16)


def test_who_floods_fills_a_share_of_the_inbox_and_the_others_wait_behind_that_alone() -> None:
    box = Inbox()
    for _ in range(10_000):
        box.put(Arrival("r/ev/loud/credit", b""))
    box.put(Arrival("r/ev/calm/result", b""))
    assert box.qsize() == inbox.BACKLOG + inbox.SHARE_MAX + 1
    assert box.dropped == 10_000 - inbox.BACKLOG - inbox.SHARE_MAX
    while not box.empty():
        last = box.get()
    assert last == Arrival("r/ev/calm/result", b"")
    box.put(Arrival("r/ev/loud/credit", b""))
    assert box.qsize() == 1


def test_a_flood_of_one_topic_leaves_the_others_of_that_evaluator_alone() -> None:
    box = Inbox()
    fill(box)
    for _ in range(10_000):
        box.put(Arrival("r/ev/a/credit", b""))
        box.put(Arrival("r/ev/a/hello", b""))
    assert box.qsize() == inbox.BACKLOG + inbox.SHARE_MAX + inbox.HELLOS_MAX
    for topic in ("renew", "result", "bye"):
        box.put(Arrival(f"r/ev/a/{topic}", b""))
    assert box.qsize() == inbox.BACKLOG + inbox.SHARE_MAX + inbox.HELLOS_MAX + 3


def test_in_a_crowd_the_unknown_take_nothing_from_the_share_of_those_they_speak_for() -> None:
    box = Inbox(Strict())
    fill(box)
    for _ in range(10_000):
        box.put(Arrival("r/ev/a/result", b"let me in"))
    box.put(Arrival("r/ev/a/result", b"please"))
    assert (box.qsize(), box.dropped) == (inbox.BACKLOG + 1, 10_000)


def test_in_a_crowd_lives_that_nobody_minds_are_dropped() -> None:
    box = Inbox(Strict())
    fill(box)
    for boot in ("nobody", "please"):
        box.put(Presence(f"r/live/ev/a/{boot}", alive=False))
    assert (box.qsize(), box.dropped) == (inbox.BACKLOG + 1, 1)


def test_where_there_is_room_nobody_is_asked_who_it_is() -> None:
    box = Inbox(Strict())
    box.put(Arrival("r/ev/a/result", b"let me in"))
    box.put(Presence("r/live/ev/a/nobody", alive=True))
    assert (box.qsize(), box.dropped) == (2, 0)


def test_what_is_larger_than_any_message_never_waits() -> None:
    box = Inbox()
    for _ in range(2):
        box.put(Arrival("r/ev/a/result", bytes(CONTROL_BYTES_MAX + 1)))
        fill(box)
    assert (box.qsize(), box.dropped) == (2 * inbox.BACKLOG, 2)


def test_keys_are_counted_anew_rather_than_without_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(inbox, "BACKLOG", 0)
    monkeypatch.setattr(inbox, "KEYS_MAX", 10)
    box = Inbox()
    for name in range(1000):
        box.put(Arrival(f"r/ev/{name}/credit", b""))
        assert len(box._shares) <= 10
