"""Episodes behind the last one: handed out and counted like any, and never told to the learner."""

from __future__ import annotations

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulation.lab import LEASE_S, Lab, published, said

from shearline.learner.dispatcher import Book, history
from shearline.learner.dispatcher.entries import (
    AnyEntry,
    ConfirmationProposed,
    RunEnded,
)
from shearline.learner.dispatcher.events import Planned, ProposalsReady
from shearline.learner.dispatcher.instructions import Ask, Ending, EndRun, Instruction, Publish
from shearline.learner.dispatcher.rules import Rules
from shearline.learner.dispatcher.status import Vitals, status
from shearline.protocol.messages import (
    CommandKind,
    Counted,
    EpisodeClosed,
    OutcomeKind,
    Proposed,
    Purpose,
)
from shearline.protocol.task import TaskSpec

TASK = TaskSpec(name="bench", space={"x": ("", 0.0, 1.0)})


def learned(confirm: int = 3, confirm_region: int = 0, **rules: object) -> Lab:
    """Return a run of two trials that has learned all it will, and asks for what follows."""
    lab = Lab(trials=2, episodes=1, confirm=confirm, confirm_region=confirm_region, **rules)
    lab.hello("a")
    lab.propose()
    lab.finish("a", cost=0.5)
    return lab


def asked(lab: Lab) -> Ask:
    """Return the newest ask."""
    return [i for i in lab.out if isinstance(i, Ask)][-1]


def answer(lab: Lab) -> list[Instruction]:
    """Have the learner answer it."""
    ask = asked(lab)
    planned = [Planned(n, [0.25], 100 + n) for n in range(ask.first, ask.first + ask.trials)]
    return lab.do(ProposalsReady(ask.episode, planned))


def ending(lab: Lab) -> EndRun:
    """Return how the run ended."""
    (end,) = [i for i in lab.out if isinstance(i, EndRun)]
    return end


def test_what_was_recommended_is_asked_for_when_the_last_episode_has_closed() -> None:
    lab = learned(confirm=3)
    ask = asked(lab)
    assert (ask.episode, ask.trials, ask.first, ask.purpose) == (1, 3, 2, Purpose.CONFIRMATION)
    assert [tell.trial for tell in ask.tells] == [0, 1]


def test_without_a_confirmation_the_run_ends_there() -> None:
    assert ending(learned(confirm=0)).ending is Ending.COMPLETE


def test_a_confirmation_is_counted_once_and_not_told() -> None:
    lab = learned(confirm=3)
    answer(lab)
    lab.finish("a", cost=0.25)
    end = ending(lab)
    assert end.ending is Ending.COMPLETE
    assert end.tells == ()
    assert lab.dispatcher.book.tally.counted == 5
    assert [tell.trial for batch in lab.dispatcher.book.told for tell in batch] == [0, 1]


def test_observers_can_tell_a_confirmation_from_learning() -> None:
    lab = learned(confirm=1, confirm_region=2)
    answer(lab)
    lab.finish("a")
    answer(lab)
    lab.finish("a")
    expected = [Purpose.LEARNING] * 2 + [Purpose.CONFIRMATION] + [Purpose.REGION] * 2
    assert [m.purpose for m in published(lab.out, Proposed)] == expected
    assert [m.purpose for m in published(lab.out, Counted)] == expected
    closed = published(lab.out, EpisodeClosed)
    assert [c.purpose for c in closed] == list(Purpose)
    assert "the trials of the region closed: 2 of 2 succeeded" in said(lab.out)


def test_a_region_that_could_not_be_stated_costs_no_trial() -> None:
    lab = learned(confirm=0, confirm_region=5)
    lab.do(ProposalsReady(1, []))
    assert ending(lab).ending is Ending.COMPLETE
    assert lab.dispatcher.book.tally.counted == 2


def test_a_confirmation_without_a_verdict_does_not_fail_the_run() -> None:
    lab = learned(confirm=1)
    answer(lab)
    while lab.dispatcher.book.episode is not None:
        held = next(iter(lab.dispatcher.book.held_by["a"]))
        lab.result("a", held, OutcomeKind.ABORTED, why="the arm was stopped")
    assert ending(lab).ending is Ending.COMPLETE
    assert lab.dispatcher.book.tally.lost == 1
    assert [c.kind for c in published(lab.out, Counted)][-1] is None


def test_an_outcome_that_comes_during_the_confirmation_is_told_with_the_last_word() -> None:
    lab = Lab(trials=2, episodes=1, confirm=1, quorum=0.5, quorum_after_s=0.1)
    lab.hello("a", credits=4)
    lab.propose()
    first, second = lab.given("a")
    lab.wait(1.0, "a")
    lab.result("a", first.token)
    answer(lab)
    lab.result("a", second.token, cost=7.0)
    assert published(lab.out, Counted)[-1].late
    lab.finish("a")
    assert [(t.trial, t.cost) for t in ending(lab).tells] == [(1, 7.0)]


def test_a_stop_during_the_confirmation_can_be_resumed() -> None:
    lab = learned(confirm=3)
    answer(lab)
    lab.command(CommandKind.STOP)
    lab.finish("a")
    assert ending(lab).ending is Ending.STOPPED
    lab.out.clear()
    lab.boot()
    lab.hello("a", boot="second-life")
    lab.wait(3 * LEASE_S)
    lab.credit("a", boot="second-life")
    while lab.holds("a"):
        lab.finish("a")
    assert ending(lab).ending is Ending.COMPLETE
    assert lab.dispatcher.book.tally.counted == 5


@pytest.mark.parametrize("written", range(1, 20))
def test_a_restart_anywhere_asks_for_the_same_confirmation(written: int) -> None:
    whole = learned(confirm=2, confirm_region=1)
    answer(whole)
    whole.finish("a")
    answer(whole)
    whole.finish("a")
    entries = [e for e in whole.journal if not isinstance(e, RunEnded)][:written]
    lab = Lab(trials=2, episodes=1, confirm=2, confirm_region=1)
    lab.journal, lab.out = list(entries), []
    lab.boot()
    asks = [i for i in whole.out if isinstance(i, Ask)]
    again = [i for i in lab.out if isinstance(i, Ask)]
    assert len(again) <= 1
    assert again or lab.dispatcher.book.episode is not None or lab.dispatcher.book.ended
    assert all(ask in asks for ask in again)


def test_the_journal_alone_leads_to_the_same_book_and_messages() -> None:
    lab = learned(confirm=2, confirm_region=2)
    answer(lab)
    lab.finish("a")
    answer(lab)
    lab.finish("a")
    packed = [msgspec.msgpack.encode(e) for e in lab.journal]
    entries = [msgspec.msgpack.decode(p, type=AnyEntry) for p in packed]
    assert sum(isinstance(e, ConfirmationProposed) for e in entries) == 2
    assert Book.of(entries).purposes == list(Purpose)
    told = [i.message for i in lab.out if isinstance(i, Publish)]
    heard = [m for m in told if isinstance(m, Proposed | Counted | EpisodeClosed)]
    assert list(history(entries)) == heard


@given(
    episodes=st.integers(1, 50),
    trials=st.integers(1, 50),
    confirm=st.integers(0, 3),
    region=st.integers(0, 3),
)
def test_the_agenda_is_every_episode_then_what_is_to_be_confirmed(
    episodes: int, trials: int, confirm: int, region: int
) -> None:
    rules = Rules(TASK, episodes, trials, confirm=confirm, confirm_region=region)
    agenda: list[tuple[Purpose, int]] = []
    while (entry := rules.agenda(len(agenda))) is not None:
        agenda.append(entry)
    assert agenda[:episodes] == [(Purpose.LEARNING, trials)] * episodes
    assert dict(agenda[episodes:]) == {
        purpose: count
        for purpose, count in ((Purpose.CONFIRMATION, confirm), (Purpose.REGION, region))
        if count
    }


def test_a_status_counts_what_follows_the_last_episode() -> None:
    lab = learned(confirm=3, confirm_region=2)
    now = status(lab.dispatcher, run="r", learner="lhs", vitals=Vitals())
    assert (now.episodes, now.trials_per_episode, now.confirming) == (1, 2, 5)


# -- on evaluators of one kind ---------------------------------------------------------------------


def on_robots() -> Lab:
    """Return a run of a function that is to be confirmed on robots, asking for that."""
    return learned(confirm_on="robot", confirm_region=1)


def test_what_is_to_be_confirmed_on_robots_waits_for_one() -> None:
    lab = on_robots()
    assert "the confirmation waits for a robot" in said(answer(lab))
    lab.wait(60.0, "a")
    assert not lab.holds("a")
    assert lab.dispatcher.state == "running"


def test_a_robot_that_comes_gets_it_and_nobody_else() -> None:
    lab = on_robots()
    answer(lab)
    lab.hello("arm", kind="robot", credits=1)
    assert lab.holds("arm") == [2]
    lab.credit("a")
    lab.wait(4.0, "a", "arm")
    assert not lab.holds("a")


def test_a_trial_that_failed_on_the_only_robot_goes_back_to_it() -> None:
    lab = on_robots()
    lab.hello("arm", kind="robot", credits=1)
    answer(lab)
    (token,) = lab.dispatcher.book.held_by["arm"]
    lab.result("arm", token, OutcomeKind.ABORTED, why="user stop")
    lab.wait(4.0, "a", "arm")
    lab.finish("arm")
    assert lab.dispatcher.book.tally.counted == 2 + 3


def test_draws_from_the_region_are_for_anybody() -> None:
    lab = on_robots()
    lab.hello("arm", kind="robot", credits=1)
    answer(lab)
    lab.finish("arm")
    answer(lab)
    lab.finish("a")
    lab.finish("arm")
    assert ending(lab).ending is Ending.COMPLETE


def test_every_outcome_says_what_kind_of_evaluator_it_came_from() -> None:
    lab = on_robots()
    lab.hello("arm", kind="robot", credits=1)
    answer(lab)
    lab.finish("arm")
    kinds = {m.trial: m.evaluator_kind for m in published(lab.out, Counted)}
    assert kinds == {0: "function", 1: "function", 2: "robot", 3: "robot", 4: "robot"}
    again = {m.trial: m.evaluator_kind for m in history(lab.journal) if isinstance(m, Counted)}
    assert again == kinds
