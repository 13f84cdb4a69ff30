"""The inbox never waits, never grows past its budget, and says what it threw away."""

import time

from hypothesis import given
from hypothesis import strategies as st

from shearline.protocol.intake import Arrival, Presence
from shearline.record.inbox import Inbox

TRACE = "shearline/@v1/run/obs/trace/sim-0"
SMALL = "shearline/@v1/run/obs/counted"


def drain(inbox: Inbox) -> list[bytes]:
    found = []
    while (item := inbox.get(0.0)) is not None:
        found.append(item.payload)
    return found


@given(sizes=st.lists(st.integers(0, 40), max_size=40), budget=st.integers(0, 100))
def test_the_newest_traces_that_fit_are_kept_and_the_rest_is_counted(
    sizes: list[int], budget: int
) -> None:
    inbox = Inbox(bulk_bytes_max=budget)
    payloads = [bytes([i % 256]) * size for i, size in enumerate(sizes)]
    for payload in payloads:
        inbox.put(Arrival(TRACE, payload))
    kept = drain(inbox)
    traces, others = inbox.take_dropped()
    assert kept == payloads[len(payloads) - len(kept) :]
    assert sum(map(len, kept)) <= budget
    assert traces.count == len(payloads) - len(kept)
    assert traces.total_bytes == sum(sizes) - sum(map(len, kept))
    assert others.count == 0


def test_traces_never_crowd_out_outcomes() -> None:
    inbox = Inbox(bulk_bytes_max=100)
    inbox.put(Arrival(SMALL, b"first"))
    for _ in range(50):
        inbox.put(Arrival(TRACE, bytes(60)))
    inbox.put(Arrival(SMALL, b"last"))
    assert drain(inbox) == [b"first", b"last", bytes(60)]


def test_even_small_messages_have_an_end() -> None:
    inbox = Inbox(small_bytes_max=10)
    for i in range(9):
        inbox.put(Arrival(SMALL, bytes([i]) * 4))
    assert drain(inbox) == [bytes([7]) * 4, bytes([8]) * 4]
    assert inbox.take_dropped()[1].count == 7


def test_what_was_dropped_is_said_once() -> None:
    inbox = Inbox(bulk_bytes_max=0)
    inbox.put(Arrival(TRACE, b"x"))
    assert inbox.take_dropped()[0].count == 1
    assert inbox.take_dropped()[0].count == 0


def test_an_item_carries_the_time_it_came() -> None:
    inbox = Inbox()
    before_ns = time.time_ns()
    inbox.put(Arrival(SMALL, b"x"))
    item = inbox.get(0.0)
    assert item is not None
    assert before_ns <= item.at_ns <= time.time_ns()


def test_a_learner_is_alive_as_long_as_one_of_its_tokens_is() -> None:
    inbox = Inbox()
    assert not inbox.any_learner()
    inbox.put(Presence("live/learner/1", alive=True))
    inbox.put(Presence("live/learner/2", alive=True))
    inbox.put(Presence("live/learner/1", alive=False))
    assert inbox.any_learner()
    inbox.put(Presence("live/learner/2", alive=False))
    assert not inbox.any_learner()
    assert drain(inbox) == []


def test_one_waits_for_a_learner_only_so_long() -> None:
    inbox = Inbox()
    assert not inbox.wait_for_learner(0.0)
    inbox.put(Presence("live/learner/1", alive=True))
    assert inbox.wait_for_learner(0.0)
