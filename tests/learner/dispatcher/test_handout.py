"""Who gets what: credits, prefetch, preference, copies."""

from __future__ import annotations

import pytest
from simulation.lab import LEASE_S, Lab

from shearline.learner.dispatcher.entries import AttemptIssued
from shearline.learner.dispatcher.instructions import Journal, Send
from shearline.protocol.messages import CommandKind, OutcomeKind, Trial


def test_an_attempt_is_journaled_before_it_is_sent() -> None:
    lab = Lab()
    lab.hello("a")
    out = lab.propose()
    issued = [i for i in out if isinstance(i, Journal) and isinstance(i.entry, AttemptIssued)]
    trials = [i for i in out if isinstance(i, Send) and isinstance(i.message, Trial)]
    assert len(issued) == len(trials) == 2
    assert all(out.index(a) < out.index(b) for a, b in zip(issued, trials, strict=True))


def test_an_evaluator_is_handed_as_many_as_it_has_credits_for() -> None:
    lab = Lab(trials=9)
    lab.hello("a", credits=3)
    lab.propose()
    assert lab.holds("a") == [0, 1, 2]


def test_an_evaluator_without_credits_is_handed_nothing() -> None:
    lab = Lab()
    lab.hello("a", credits=0)
    lab.propose()
    assert lab.holds("a") == []
    lab.credit("a", 1)
    assert lab.holds("a") == [0]


def test_an_older_credit_that_arrives_late_is_ignored() -> None:
    lab = Lab()
    lab.hello("a", credits=0)
    lab.propose()
    lab.credit("a", 0, seq=8)
    lab.credit("a", 2, seq=7)
    assert lab.holds("a") == []


def test_a_freed_evaluator_is_handed_the_next_in_the_same_step() -> None:
    lab = Lab(trials=4)
    lab.hello("a", credits=1)
    lab.propose()
    out = lab.result("a", lab.given("a")[0].token)
    assert [t.trial for t in lab.given("a", out)] == [1]


def test_the_first_trials_are_spread_before_anyone_prefetches() -> None:
    lab = Lab(trials=4)
    for name in "abcd":
        lab.hello(name)
    lab.propose()
    assert [lab.holds(name) for name in "abcd"] == [[0], [1], [2], [3]]


def test_the_last_trials_of_an_episode_wait_for_whoever_is_free_first() -> None:
    lab = Lab(trials=5)
    for name in "abcd":
        lab.hello(name)
    lab.propose()
    assert sum(len(lab.holds(name)) for name in "abcd") == 4
    lab.result("c", lab.given("c")[0].token)
    assert lab.holds("c") == [4]


def test_a_lone_evaluator_prefetches_to_the_end() -> None:
    lab = Lab(trials=2)
    lab.hello("a")
    lab.propose()
    assert lab.holds("a") == [0, 1]


def test_an_evaluator_that_comes_late_gets_work_at_once() -> None:
    lab = Lab(trials=9)
    lab.hello("a")
    lab.propose()
    lab.hello("b")
    assert len(lab.holds("b")) == 2


def test_a_trial_that_failed_on_one_evaluator_goes_to_another() -> None:
    lab = Lab(trials=3)
    lab.hello("a", credits=1)
    lab.hello("b", credits=1)
    lab.propose()
    lab.result("a", lab.given("a")[0].token, OutcomeKind.REJECTED)
    assert lab.holds("a") == [2]
    lab.result("b", lab.given("b")[0].token)
    assert lab.holds("b") == [0]


def test_a_trial_that_failed_on_the_only_evaluator_goes_back_to_it() -> None:
    lab = Lab(trials=1)
    lab.hello("a")
    lab.propose()
    lab.result("a", lab.given("a")[0].token, OutcomeKind.ABORTED)
    assert lab.holds("a") == [0]
    assert [t.attempt for t in lab.given("a")] == [1, 2]


def test_a_trial_waits_for_the_evaluator_that_has_not_failed_on_it() -> None:
    lab = Lab(trials=2)
    lab.hello("a", credits=1)
    lab.hello("b", credits=1)
    lab.propose()
    lab.result("a", lab.given("a")[0].token, OutcomeKind.REJECTED)
    assert lab.holds("a") == []
    lab.finish("b")
    assert [row.result is not None for row in lab.dispatcher.book.rows(0)] == [True, True]


def slow_one(*, speculative: bool = True) -> Lab:
    """Return a lab in which ``a`` is slow with the last trial and ``b`` has done all others."""
    lab = Lab(trials=8, speculative=speculative)
    lab.hello("a", credits=1)
    lab.hello("b", credits=1)
    lab.propose()
    while len(lab.dispatcher.book.live) > 1 or lab.dispatcher.book.pending:
        lab.wait(0.25, "a", "b")
        lab.result("b", next(iter(lab.dispatcher.book.held_by["b"])))
    return lab


def test_a_slow_attempt_is_copied_once_when_nothing_is_pending() -> None:
    lab = slow_one()
    lab.wait(3.0, "a", "b")
    assert lab.holds("a") == lab.holds("b") == [0]
    lab.hello("c")
    lab.wait(3.0, "a", "b")
    assert lab.holds("c") == []


def test_the_first_result_of_two_copies_counts_and_the_other_is_surplus() -> None:
    lab = slow_one()
    lab.wait(3.0, "a", "b")
    lab.result("b", lab.given("b")[-1].token, cost=5.0)
    lab.result("a", lab.given("a")[0].token, cost=7.0)
    row = lab.dispatcher.book.trials[0]
    assert row.result is not None
    assert row.result.cost == 5.0
    assert lab.dispatcher.book.tally.surplus == 1


def test_an_attempt_that_takes_as_long_as_most_is_not_copied() -> None:
    lab = Lab(trials=12, episodes=1)
    lab.hello("a", credits=1)
    lab.hello("b", credits=1)
    lab.propose()
    while len(lab.dispatcher.book.live) > 1 or lab.dispatcher.book.pending:
        lab.wait(1.0, "a", "b")
        lab.result("b", next(iter(lab.dispatcher.book.held_by["b"])))
        lab.result("a", next(iter(lab.dispatcher.book.held_by["a"]), "no-attempt"))
        if not lab.dispatcher.book.pending:
            break
    lab.finish("b")
    lab.wait(1.0, "a", "b")
    assert lab.holds("b") == []


def test_nothing_is_copied_where_that_is_switched_off() -> None:
    lab = slow_one(speculative=False)
    lab.wait(6.0, "a", "b")
    assert lab.holds("b") == []


@pytest.mark.parametrize("robot", ["a", "b"])
def test_nothing_is_copied_from_or_to_a_robot(robot: str) -> None:
    lab = slow_one()
    evaluator = lab.dispatcher.desk.roster.get(robot)
    assert evaluator is not None
    evaluator.kind = "robot"
    lab.wait(6.0, "a", "b")
    assert lab.holds("b") == []


def test_nothing_is_copied_to_where_it_failed() -> None:
    lab = slow_one()
    lab.dispatcher.book.trials[0].failed_on.append("b")
    lab.wait(6.0, "a", "b")
    assert lab.holds("b") == []


def test_nothing_new_is_handed_out_while_held_and_everything_after_resume() -> None:
    lab = Lab(trials=8)
    lab.hello("a", credits=1)
    lab.propose()
    lab.command(CommandKind.HOLD)
    lab.result("a", lab.given("a")[0].token)
    lab.wait(LEASE_S, "a")
    lab.credit("a", 1)
    assert lab.holds("a") == []
    lab.command(CommandKind.RESUME)
    assert lab.holds("a") == [1]


def test_an_evaluator_with_slots_runs_that_many_without_prefetch() -> None:
    lab = Lab(trials=3)
    lab.hello("a", credits=4, slots=2)
    lab.hello("b", credits=4, slots=2)
    lab.propose()
    assert sorted(len(lab.holds(name)) for name in "ab") == [1, 2]
