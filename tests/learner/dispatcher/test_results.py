"""What comes back: verdicts, leases, lost and late trials."""

from __future__ import annotations

import itertools

import pytest
from simulation.lab import LEASE_S, TASK, Lab, published, said, sent, verdicts

from shearline.learner.dispatcher import core
from shearline.learner.dispatcher.entries import AttemptLapsed, LapseReason, ResultTaken
from shearline.learner.dispatcher.events import Tick
from shearline.learner.dispatcher.instructions import Ask, Instruction, Journal, Send, Told
from shearline.learner.dispatcher.rules import ATTEMPTS_MAX, REST_S_MAX
from shearline.learner.dispatcher.states import TrialState
from shearline.protocol.messages import Ack, Counted, OutcomeKind, Verdict


def one_each() -> Lab:
    """Return a lab in which ``a`` and ``b`` each hold one of eight trials."""
    lab = Lab(trials=8)
    lab.hello("a", credits=1)
    lab.hello("b", credits=1)
    lab.propose()
    return lab


def test_a_result_is_journaled_before_it_is_acknowledged() -> None:
    lab = one_each()
    out = lab.result("a", lab.given("a")[0].token)
    taken = next(
        n for n, i in enumerate(out) if isinstance(i, Journal) and isinstance(i.entry, ResultTaken)
    )
    ack = next(n for n, i in enumerate(out) if isinstance(i, Send) and isinstance(i.message, Ack))
    assert taken < ack
    assert verdicts(out) == [Verdict.COUNTED]


def test_a_result_sent_again_is_acknowledged_and_ignored() -> None:
    lab = one_each()
    token = lab.given("a")[0].token
    lab.result("a", token, cost=1.0)
    written = len(lab.journal)
    out = lab.result("a", token, cost=2.0)
    assert verdicts(out) == [Verdict.DUPLICATE]
    assert len(lab.journal) == written
    assert lab.dispatcher.desk.resends == 1


@pytest.mark.parametrize("token", ["never-issued-token", "of-b"])
def test_a_token_not_issued_to_the_evaluator_has_no_effect(token: str) -> None:
    lab = one_each()
    written, book = len(lab.journal), lab.dispatcher.book
    out = lab.result("a", lab.given("b")[0].token if token == "of-b" else token)
    assert verdicts(out) == [Verdict.UNKNOWN]
    assert len(lab.journal) == written
    assert book.tally.counted == 0
    assert lab.dispatcher.desk.unknown == 1


def test_an_attempt_not_renewed_for_a_lease_is_given_out_again() -> None:
    lab = one_each()
    lab.wait(LEASE_S + 0.3, "b")
    assert lab.dispatcher.book.trials[0].state is TrialState.PENDING
    lab.result("b", lab.given("b")[0].token)
    assert lab.holds("b") == [0]


def test_when_a_crowd_falls_silent_a_tick_gives_up_so_many_attempts_and_the_next_one_the_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(core, "LAPSES_MAX", 3)
    lab = Lab(trials=8)
    lab.propose()
    for name in "abcd":
        lab.hello(name)
    held, lapsed = len(lab.dispatcher.book.live), []
    for _ in range(16):
        out = lab.wait(LEASE_S / 8)
        lapsed += [len([i for i in out if _lapses(i)])]
    assert held > 6
    assert [n for n in lapsed if n] == [3, 3, held - 6]


def _lapses(instruction: Instruction) -> bool:
    return isinstance(instruction, Journal) and isinstance(instruction.entry, AttemptLapsed)


def test_a_renewed_attempt_keeps_its_lease() -> None:
    lab = one_each()
    lab.wait(3 * LEASE_S, "a", "b")
    assert lab.holds("a") == [0]


def test_a_renewal_of_another_evaluators_attempt_or_boot_does_nothing() -> None:
    lab = one_each()
    token = lab.given("a")[0].token
    for _ in range(12):
        lab.wait(LEASE_S / 8)
        lab.renew("b", token)
        lab.renew("a", token, boot="another-boot")
        lab.renew("a", "never-issued-token")
    assert lab.holds("a") == []


def test_an_attempt_renewed_beyond_its_deadline_is_given_up_for_good() -> None:
    lab = one_each()
    token = lab.given("a")[0].token
    lab.wait(TASK.trial_s + LEASE_S + 0.3, "a")
    reasons = [e.reason for e in lab.journal if isinstance(e, AttemptLapsed) and e.token == token]
    assert reasons == [LapseReason.DEADLINE]
    lab.renew("a", token)
    assert lab.holds("a") == []


def test_a_lapsed_attempt_that_is_renewed_in_time_goes_on() -> None:
    lab = Lab(trials=1)
    lab.hello("a", credits=1)
    lab.propose()
    lab.wait(LEASE_S + 0.3)
    assert lab.holds("a") == []
    out = lab.renew("a", lab.given("a")[0].token)
    assert lab.holds("a") == [0]
    assert len(lab.given("a")) == 1
    assert "is back" in said(out)
    assert lab.dispatcher.book.trials[0].losses == 0


def test_a_lapsed_attempt_given_out_again_is_not_taken_back() -> None:
    lab = one_each()
    lab.wait(LEASE_S + 0.3, "b")
    lab.result("b", lab.given("b")[0].token)
    lab.renew("a", lab.given("a")[0].token)
    assert (lab.holds("a"), lab.holds("b")) == ([2], [0])


def test_the_result_of_a_lapsed_attempt_counts_if_it_is_first() -> None:
    lab = one_each()
    lab.wait(LEASE_S + 0.3, "b")
    lab.result("b", lab.given("b")[0].token)
    assert verdicts(lab.result("a", lab.given("a")[0].token, cost=3.0)) == [Verdict.COUNTED]
    assert verdicts(lab.result("b", lab.given("b")[-1].token, cost=4.0)) == [Verdict.DUPLICATE]
    row = lab.dispatcher.book.trials[0]
    assert row.result is not None
    assert row.result.cost == 3.0


def lost_trial() -> tuple[Lab, list[str]]:
    """Return a lab whose first trial lapsed three times, and the tokens of its attempts."""
    lab = Lab(trials=1, episodes=1)
    for name in "abc":
        lab.hello(name, credits=1)
        if name == "a":
            lab.propose()
        else:
            lab.wait(0.25)
        lab.gone(name)
    return lab, [e.token for e in lab.journal if isinstance(e, AttemptLapsed)]


def test_a_trial_whose_attempts_lapsed_three_times_is_lost_and_never_a_cost() -> None:
    lab, tokens = lost_trial()
    assert len(tokens) == 3
    assert lab.dispatcher.book.trials[0].state is TrialState.LOST
    assert lab.dispatcher.book.tally.lost == 1
    assert [c.kind for c in published(lab.out, Counted)] == [None]
    assert lab.dispatcher.book.told == [()]


def test_the_late_result_of_a_lost_trial_is_kept() -> None:
    lab, tokens = lost_trial()
    assert verdicts(lab.result("a", tokens[0])) == [Verdict.LATE]
    assert lab.dispatcher.book.trials[0].state is TrialState.LATE
    assert (lab.dispatcher.book.tally.lost, lab.dispatcher.book.tally.late) == (0, 1)
    assert published(lab.out, Counted)[-1].late
    assert verdicts(lab.result("b", tokens[1])) == [Verdict.DUPLICATE]


def test_a_late_result_reaches_the_learner_with_the_next_update() -> None:
    lab = Lab(trials=4, quorum=0.5, quorum_after_s=1.0)
    lab.hello("a", credits=1)
    lab.hello("b", credits=1)
    lab.propose()
    lab.wait(1.5, "a", "b")
    for _ in range(2):
        lab.result("b", next(iter(lab.dispatcher.book.held_by["b"])), cost=2.0)
    assert lab.dispatcher.book.trials[0].state is TrialState.LEFT
    assert verdicts(lab.result("a", lab.given("a")[0].token, cost=9.0)) == [Verdict.LATE]
    assert lab.dispatcher.book.untold == [Told(0, 9.0, success=True)]
    lab.propose(1)
    lab.finish("a")
    lab.finish("b")
    assert Told(0, 9.0, success=True) in lab.dispatcher.book.told[1]


def test_outcomes_reach_the_learner_in_order_of_trials_whatever_came_first() -> None:
    lab = Lab(trials=3)
    for name in "abc":
        lab.hello(name, credits=1)
    lab.propose()
    out = []
    for name in "cab":
        out = lab.result(name, lab.given(name)[0].token)
    asks = [i for i in out if isinstance(i, Ask)]
    assert [[t.trial for t in ask.tells] for ask in asks] == [[0, 1, 2]]
    assert asks[0].episode == 1


@pytest.mark.parametrize("kind", [OutcomeKind.ABORTED, OutcomeKind.REJECTED])
def test_what_reached_no_verdict_is_noted_and_given_out_again(kind: OutcomeKind) -> None:
    lab = one_each()
    out = lab.result("a", lab.given("a")[0].token, kind, why="user stop")
    assert verdicts(out) == [Verdict.NOTED]
    assert "user stop" in said(out)
    tally = lab.dispatcher.book.tally
    assert (tally.aborted, tally.rejected) == ((1, 0) if kind is OutcomeKind.ABORTED else (0, 1))
    assert lab.dispatcher.book.trials[0].state is TrialState.PENDING


def test_an_evaluator_whose_attempts_lapse_rests_longer_each_time() -> None:
    lab = Lab(trials=1, losses_max=40)
    lab.hello("a", credits=1)
    lab.propose()
    given_s = [lab.now_s]
    while len(given_s) < 9:
        lab.wait(0.25)
        lab.credit("a", 1)
        if len(lab.given("a")) > len(given_s):
            given_s.append(lab.now_s)
    gaps_s = [after - before for before, after in itertools.pairwise(given_s)]
    assert gaps_s == sorted(gaps_s)
    assert gaps_s[0] < 3 * LEASE_S
    assert REST_S_MAX <= gaps_s[-1] <= REST_S_MAX + 2 * LEASE_S


def test_a_sign_of_its_trial_loop_ends_an_evaluators_rest() -> None:
    lab = one_each()
    token = lab.given("a")[0].token
    lab.wait(LEASE_S + 0.3, "b")
    lab.result("a", token)
    assert lab.holds("a") == [2]


def test_a_trial_that_was_given_back_for_ever_is_lost_in_the_end() -> None:
    lab = Lab(trials=1, episodes=1)
    lab.propose()
    for n in range(ATTEMPTS_MAX):
        assert lab.dispatcher.book.tally.lost == 0
        lab.hello(f"e{n}", credits=1)
        lab.bye(f"e{n}")
    assert lab.dispatcher.book.tally.lost == 1


def test_a_learner_that_was_itself_stopped_blames_nobody() -> None:
    lab = one_each()
    lab.wait(0.5, "a", "b")
    for jump_s in (3600.0, -7200.0):
        lab.now_s += jump_s
        lab.do(Tick())
        assert lab.holds("a") == [0]
    lab.wait(3 * LEASE_S, "a", "b")
    assert lab.holds("a") == [0]


def test_every_line_of_the_log_names_its_cause() -> None:
    lab = one_each()
    lab.wait(LEASE_S + 0.3, "b")
    story = {number: type(event).__name__ for number, _, event, _ in lab.dispatcher.story}
    lapsed = next(e for e in lab.journal if isinstance(e, AttemptLapsed))
    assert story[lapsed.stimulus] == "Tick"
    assert not sent(lab.out, Ack)


def test_a_result_said_again_is_no_sign_of_life_of_its_sender() -> None:
    lab = one_each()
    token = lab.given("a")[0].token
    lab.result("a", token)
    lab.gone("a")
    handed = len(lab.given("a"))
    lab.result("a", token)
    lab.hello("b", credits=2)
    assert len(lab.given("a")) == handed
    evaluator = lab.dispatcher.desk.roster.get("a")
    assert evaluator is not None
    assert evaluator.gone


def test_the_last_words_of_the_dead_do_not_bring_it_back() -> None:
    lab = one_each()
    token = lab.given("a")[0].token
    lab.gone("a")
    handed = len(lab.given("a"))
    assert verdicts(lab.result("a", token)) == [Verdict.COUNTED]
    lab.renew("a", token)
    assert len(lab.given("a")) == handed
    lab.hello("a", credits=1)
    assert len(lab.given("a")) == handed + 1
