"""Episodes and the run: asking, closing, holding, stopping, failing, and going on."""

from __future__ import annotations

import msgspec
import pytest
from simulation.lab import LEASE_S, Lab, published, said, sent, verdicts

from shearline.learner.dispatcher import Book, history
from shearline.learner.dispatcher.checks import check
from shearline.learner.dispatcher.entries import (
    AnyEntry,
    LearnerBooted,
    RunEnded,
    RunOpened,
    RunRuled,
)
from shearline.learner.dispatcher.events import LearnerFailed, ProposalsReady
from shearline.learner.dispatcher.instructions import (
    Ask,
    Broadcast,
    Ending,
    EndRun,
    Instruction,
    Journal,
    Publish,
)
from shearline.learner.dispatcher.states import RunState
from shearline.learner.dispatcher.status import Vitals, status
from shearline.protocol.messages import (
    Command,
    CommandKind,
    Counted,
    EpisodeClosed,
    OutcomeKind,
    Proposed,
    Trial,
    Verdict,
)


def the(out: list[Instruction], kind: type[EndRun]) -> EndRun:
    """Return the one instruction of a kind."""
    (found,) = [i for i in out if isinstance(i, kind)]
    return found


def test_the_epoch_is_journaled_before_anything_else_happens() -> None:
    lab = Lab()
    assert isinstance(lab.out[0], Journal)
    assert isinstance(lab.out[0].entry, LearnerBooted)
    assert isinstance(lab.out[1], Ask)


def test_each_life_of_the_learner_has_its_own_epoch_even_if_nothing_happened() -> None:
    lab = Lab()
    for epoch in (2, 3, 4):
        lab.boot()
        assert lab.dispatcher.book.epoch == epoch


def test_a_whole_run_counts_every_trial_once() -> None:
    lab = Lab(trials=3, episodes=2)
    lab.hello("a")
    for episode in range(2):
        lab.propose(episode)
        lab.finish("a", cost=0.5 + episode)
    end = the(lab.out, EndRun)
    assert (end.ending, end.why) == (Ending.COMPLETE, "")
    assert [t.trial for t in end.tells] == [3, 4, 5]
    closed = published(lab.out, EpisodeClosed)
    assert [(c.episode, c.trials, c.successes, c.mean_cost) for c in closed] == [
        (0, 3, 3, 0.5),
        (1, 3, 3, 1.5),
    ]
    assert len(published(lab.out, Proposed)) == len(published(lab.out, Counted)) == 6
    assert Command(kind=CommandKind.STOP, why="the run is complete") in [
        i.message for i in lab.out if isinstance(i, Broadcast)
    ]


def test_failures_are_in_the_mean_but_never_the_best() -> None:
    lab = Lab(trials=2, episodes=1)
    lab.hello("a")
    lab.propose()
    lab.result("a", lab.given("a")[0].token, OutcomeKind.FAILURE, cost=0.1)
    lab.result("a", lab.given("a")[1].token, OutcomeKind.SUCCESS, cost=0.7)
    (closed,) = published(lab.out, EpisodeClosed)
    assert (closed.successes, closed.success_rate) == (1, 0.5)
    assert closed.mean_cost == pytest.approx(0.4)
    assert closed.best_cost == 0.7


def test_proposals_that_nobody_asked_for_are_ignored() -> None:
    lab = Lab()
    assert lab.do(ProposalsReady(1, [])) == []
    lab.propose()
    assert lab.do(ProposalsReady(0, [])) == []


def test_an_episode_waits_for_its_quorum_and_its_deadline() -> None:
    lab = Lab(trials=4, quorum=0.5, quorum_after_s=3.0)
    lab.hello("a", credits=4)
    lab.propose()
    lab.result("a", lab.given("a")[0].token)
    lab.wait(4.0, "a")
    assert not published(lab.out, EpisodeClosed)
    lab.result("a", lab.given("a")[1].token)
    assert [c.trials for c in published(lab.out, EpisodeClosed)] == [2]
    assert lab.dispatcher.book.tally.lost == 2
    assert [c.why for c in published(lab.out, Counted) if c.kind is None] == [
        "its episode closed without it"
    ] * 2


def test_an_episode_without_a_quorum_rule_waits_for_all() -> None:
    lab = Lab(trials=2, quorum_after_s=0.0)
    lab.hello("a")
    lab.propose()
    lab.result("a", lab.given("a")[0].token)
    lab.wait(6.0, "a")
    assert not published(lab.out, EpisodeClosed)


def test_a_task_that_never_reaches_a_verdict_fails_the_run_with_its_own_words() -> None:
    lab = Lab(trials=2)
    lab.hello("a")
    lab.propose()
    while lab.dispatcher.state is RunState.RUNNING:
        held = next(iter(lab.dispatcher.book.held_by["a"]))
        lab.result("a", held, OutcomeKind.ABORTED, why="ValueError: no such file")
    end = the(lab.out, EndRun)
    assert end.ending is Ending.FAILED
    assert "ValueError: no such file" in end.why
    assert isinstance(lab.journal[-1], RunEnded)
    assert not lab.journal[-1].ok


def test_a_learner_that_fails_ends_the_run_which_can_be_resumed() -> None:
    lab = Lab()
    end = the(lab.do(LearnerFailed("the learner failed: no memory")), EndRun)
    assert (end.ending, end.why) == (Ending.FAILED, "the learner failed: no memory")
    assert lab.dispatcher.book.ended is None
    assert lab.do(LearnerFailed("again")) == []


def test_a_stop_waits_for_what_runs_and_hands_out_nothing_more() -> None:
    lab = Lab(trials=8)
    lab.hello("a")
    lab.propose()
    lab.command(CommandKind.STOP, "lunch")
    assert lab.dispatcher.state is RunState.STOPPING
    assert lab.command(CommandKind.STOP) == []
    assert lab.command(CommandKind.RESUME) == []
    for trial in lab.given("a"):
        assert verdicts(lab.result("a", trial.token)) == [Verdict.COUNTED]
    end = the(lab.out, EndRun)
    assert (end.ending, end.why, len(end.tells)) == (Ending.STOPPED, "lunch", 2)
    assert len(lab.given("a")) == 2


def test_a_stop_waits_no_longer_than_its_grace() -> None:
    lab = Lab(stop_grace_s=1.0)
    lab.hello("a")
    lab.propose()
    lab.command(CommandKind.STOP)
    lab.wait(1.3, "a")
    assert the(lab.out, EndRun).why == "stopped by the operator"


@pytest.mark.parametrize("leave", [Lab.bye, Lab.gone])
def test_a_stop_ends_when_the_last_evaluator_is_gone(leave: object) -> None:
    lab = Lab()
    lab.hello("a")
    lab.propose()
    lab.command(CommandKind.STOP)
    leave(lab, "a")  # type: ignore[operator]
    assert the(lab.out, EndRun).ending is Ending.STOPPED


def test_what_our_own_stop_aborted_is_not_held_against_the_trial() -> None:
    lab = Lab(trials=1)
    lab.hello("a", credits=1)
    lab.propose()
    lab.command(CommandKind.STOP)
    lab.result("a", lab.given("a")[0].token, OutcomeKind.ABORTED)
    assert lab.dispatcher.book.trials[0].aborts == 0
    assert lab.dispatcher.book.tally.aborted == 0


def test_a_stop_that_meets_the_end_of_the_last_episode_completes_the_run() -> None:
    lab = Lab(trials=1, episodes=1)
    lab.hello("a")
    lab.propose()
    lab.command(CommandKind.STOP)
    lab.finish("a")
    assert the(lab.out, EndRun).ending is Ending.COMPLETE


def test_a_stop_that_meets_the_end_of_an_episode_does_not_ask_for_another() -> None:
    lab = Lab(trials=1, episodes=2)
    lab.hello("a")
    lab.propose()
    lab.command(CommandKind.STOP)
    lab.finish("a")
    assert the(lab.out, EndRun).ending is Ending.STOPPED
    assert [i.episode for i in lab.out if isinstance(i, Ask)] == [0]
    assert [i.episode for i in lab.boot() if isinstance(i, Ask)] == [1]


def test_results_are_still_answered_after_the_end() -> None:
    lab = Lab(trials=4)
    lab.hello("a")
    lab.propose()
    tokens = [t.token for t in lab.given("a")]
    lab.command(CommandKind.STOP)
    lab.wait(10.0)
    assert lab.dispatcher.state is RunState.ENDED
    assert verdicts(lab.result("a", tokens[0])) == [Verdict.COUNTED]
    lab.bye("a")
    lab.wait(1.0)
    assert len([i for i in lab.out if isinstance(i, EndRun)]) == 1


def test_a_held_run_is_still_held_after_a_restart() -> None:
    lab = Lab()
    lab.hello("a")
    lab.propose()
    lab.command(CommandKind.HOLD)
    lab.command(CommandKind.HOLD)
    assert len([e for e in lab.journal if isinstance(e, RunRuled)]) == 1
    lab.boot()
    assert lab.dispatcher.state is RunState.HELD
    assert not sent(lab.hello("b"), Trial)


def test_a_restart_waits_for_what_runs_and_accepts_what_was_done_meanwhile() -> None:
    lab = Lab(trials=4)
    lab.hello("a")
    lab.propose()
    tokens = [t.token for t in lab.given("a")]
    lab.boot()
    assert verdicts(lab.result("a", tokens[0])) == [Verdict.COUNTED]
    lab.hello("a")
    assert tokens[1] in lab.dispatcher.book.held_by["a"]
    lab.wait(LEASE_S, "a")
    assert verdicts(lab.result("a", tokens[1])) == [Verdict.COUNTED]


def test_a_restart_gives_up_what_nobody_came_back_with() -> None:
    lab = Lab(trials=1)
    lab.hello("a")
    lab.propose()
    lab.boot()
    lab.hello("b")
    assert lab.holds("b") == []
    lab.wait(3 * LEASE_S, "b")
    lab.credit("b")
    assert lab.holds("b") == [0]


def test_a_restart_between_two_episodes_asks_again_with_the_same_outcomes() -> None:
    lab = Lab(trials=2)
    lab.hello("a")
    lab.propose()
    lab.finish("a")
    asked = [i for i in lab.out if isinstance(i, Ask)][-1]
    assert [i for i in lab.boot() if isinstance(i, Ask)] == [asked]


def test_a_restart_after_the_last_episode_ends_the_run() -> None:
    lab = Lab(trials=1, episodes=1)
    lab.hello("a")
    lab.propose()
    lab.finish("a")
    lab.journal = [e for e in lab.journal if not isinstance(e, RunEnded)]
    assert the(lab.boot(), EndRun).ending is Ending.COMPLETE


def test_the_journal_alone_leads_to_the_same_book_and_the_same_messages() -> None:
    lab = Lab(trials=5, quorum=0.6, quorum_after_s=0.1)
    lab.hello("a")
    lab.hello("b")
    lab.propose()
    lab.wait(1.0, "a", "b")
    lab.result("a", lab.given("a")[0].token, OutcomeKind.ABORTED)
    lab.gone("b")
    lab.hello("b", boot="second-boot")
    while lab.dispatcher.book.episode == 0:
        lab.finish("a")
        lab.finish("b")
    packed = [msgspec.msgpack.encode(e) for e in lab.journal]
    entries = [msgspec.msgpack.decode(p, type=AnyEntry) for p in packed]
    again = vars(Book.of(entries))
    assert {k: v for k, v in vars(lab.dispatcher.book).items() if k != "released"} == {
        k: v for k, v in again.items() if k != "released"
    }
    told = [i.message for i in lab.out if isinstance(i, Publish)]
    heard = [m for m in told if isinstance(m, Proposed | Counted | EpisodeClosed)]
    assert list(history(entries)) == heard


def test_the_head_of_the_journal_is_kept() -> None:
    opened = RunOpened(at_s=1.0, run="r", config="")
    assert Book.of([opened]).opened == opened


def test_a_status_adds_up() -> None:
    lab = Lab(trials=6)
    lab.hello("a")
    empty = status(lab.dispatcher, run="r", learner="psp", vitals=Vitals())
    assert (empty.pending, empty.leased, empty.done, empty.state) == (0, 0, 0, "running")
    lab.propose()
    lab.result("a", lab.given("a")[0].token)
    lab.result("a", lab.given("a")[0].token)
    now = status(
        lab.dispatcher, run="r", learner="psp", vitals=Vitals(rate_hz=2.0, step_ms_max=3.0)
    )
    assert (now.pending, now.leased, now.done, now.counted, now.duplicates) == (3, 2, 1, 1, 1)
    assert [(e.evaluator, e.state, e.running, e.done) for e in now.evaluators] == [
        ("a", "busy", 2, 1)
    ]
    assert [e.trials for e in now.evaluators] == [[1, 2]]
    assert [e.lease_s for e in now.evaluators] == [LEASE_S]
    assert now.history == []


def test_a_broken_book_is_noticed() -> None:
    lab = Lab()
    lab.hello("a")
    lab.propose()
    lab.dispatcher.book.tally.counted += 1
    with pytest.raises(AssertionError, match="miscounted"):
        check(lab.dispatcher.desk)


def test_the_log_speaks_of_what_matters() -> None:
    lab = Lab(trials=1)
    lab.hello("a")
    lab.propose()
    lab.finish("a")
    text = said(lab.out)
    assert "a joins: function, 2 credits, bench" in text
    assert "episode 0 closed: 1 of 1 succeeded" in text
