"""Goal: one thread waits for the network and for its own process, and nothing gets past it."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator

import pytest

from shearline.protocol import link as link_module
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.intake import Arrival, Intake
from shearline.protocol.keys import Keys
from shearline.protocol.link import Link, open_client, open_router

KEYS = Keys("run-1")
RESULT = f"{KEYS.root}/ev/lab/result"
WAIT_S = 5.0


@pytest.fixture
def router() -> Iterator[Link]:
    with open_router(free_endpoint()) as link:
        yield link


@pytest.fixture
def intake(router: Link) -> Intake:
    return router.intake(KEYS.from_evaluators(), KEYS.wake())


@pytest.fixture
def client(router: Link, intake: Intake) -> Iterator[Link]:
    """A client whom the intake hears."""
    with open_client(router.endpoint) as link:
        while intake.take_nowait() is None:
            link.publish(RESULT, b"hear me")
        link.publish(RESULT, b"heard")
        while intake.take() != Arrival(RESULT, b"heard"):
            pass
        yield link


def test_what_others_send_comes_in_order(intake: Intake, client: Link) -> None:
    for number in range(200):
        client.publish(RESULT, b"%d" % number)
    assert [intake.take() for _ in range(200)] == [
        Arrival(RESULT, b"%d" % number) for number in range(200)
    ]
    assert intake.take_nowait() is None


def test_what_its_own_session_says_to_evaluators_does_not_come(
    router: Link, intake: Intake, client: Link
) -> None:
    router.publish(f"{KEYS.root}/ev/lab/trial", b"own")
    client.publish(RESULT, b"theirs")
    assert intake.take() == Arrival(RESULT, b"theirs")


def test_items_of_other_threads_wake_the_one_that_waits_and_none_is_lost(intake: Intake) -> None:
    def work(first: int) -> None:
        for number in range(first, first + 100):
            intake.put(number)

    threads = [threading.Thread(target=work, args=(100 * n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    taken: list[object] = []
    while len(taken) < 400:
        item = intake.take()
        taken += [] if item is None else [item]
    assert sorted(taken, key=str) == sorted(range(400), key=str)
    assert intake.own == 0


def test_whoever_waits_is_woken_as_often_as_asked_for(intake: Intake) -> None:
    with intake.woken_every(0.01):
        for _ in range(3):
            assert intake.take() is None


def test_a_signal_handler_of_the_waiting_thread_may_put_items_in(intake: Intake) -> None:
    def put(*_: object) -> None:
        intake.put("signalled")

    before = signal.signal(signal.SIGUSR1, put)
    try:
        with intake.woken_every(0.02):
            assert intake.take() is None  # this thread is the one that waits, from now on
            os.kill(os.getpid(), signal.SIGUSR1)
            end_s = time.monotonic() + WAIT_S
            while intake.take() != "signalled":
                assert time.monotonic() < end_s
    finally:
        signal.signal(signal.SIGUSR1, before)


def test_who_sends_faster_than_is_taken_is_slowed_down_and_nothing_is_lost(
    intake: Intake, client: Link
) -> None:
    many = 20 * link_module.INTAKE_MAX

    def send() -> None:
        for number in range(many):
            client.publish(RESULT, b"%d" % number)

    sender = threading.Thread(target=send)
    sender.start()
    for number in range(many):
        assert intake.take() == Arrival(RESULT, b"%d" % number)
    sender.join()


def test_a_closed_session_wakes_its_waiting_thread_with_nothing(
    router: Link, intake: Intake
) -> None:
    closer = threading.Timer(0.05, router.close)
    closer.start()
    assert intake.take() is None
    closer.join()
    assert intake.take_nowait() is None
