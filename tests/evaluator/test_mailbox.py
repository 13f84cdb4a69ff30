"""The worker's decisions, without a network, a thread or a clock."""

from itertools import pairwise

import pytest
from evaluator.mail_kit import (
    BOOT,
    LEASE_S,
    SPEC,
    ack,
    busy,
    drive,
    joined,
    mailbox,
    of,
    result,
    said,
    token,
    trial,
    welcome,
)
from msgspec.structs import replace

from shearline.evaluator.mail import (
    Abort,
    Beat,
    Ended,
    Event,
    Gate,
    Heard,
    Instruction,
    LearnerAlive,
    LearnerGone,
    Leave,
    Prepare,
    Quit,
    Ready,
    Resting,
    Run,
    Send,
    Settled,
    Started,
    Tick,
)
from shearline.evaluator.mailbox import (
    FINISH_S,
    HANG_S,
    HELD_MAX,
    IDLE_LEASES,
    LEAVE_S,
    SILENCE_LEASES,
)
from shearline.evaluator.outbox import ANSWERED_MAX, RESEND_S_MAX, RESEND_S_MIN
from shearline.protocol.codec import encode
from shearline.protocol.messages import (
    Ack,
    Bye,
    Command,
    CommandKind,
    Credit,
    Hello,
    OutcomeKind,
    Refused,
    Renew,
    Result,
    Verdict,
)


def test_hello_is_repeated_ever_more_slowly_until_an_answer_comes() -> None:
    box = mailbox()
    assert not drive(box, 3.0)
    assert said(box.handle(LearnerAlive(1), 3.0), Hello)
    times_s = [now_s for now_s, _ in drive(box, 7.0, 3.0)]
    gaps_s = [b - a for a, b in pairwise(times_s)]
    assert gaps_s[0] == pytest.approx(2 * RESEND_S_MIN, abs=1e-3)
    assert gaps_s[-1] == pytest.approx(RESEND_S_MAX, abs=1e-3)
    box.handle(welcome(), 7.0)
    later = [instruction for _, instruction in drive(box, 7.0 + LEASE_S, 7.0)]
    assert not said(later, Hello)


def test_a_cold_worker_has_no_credit_and_a_warm_one_says_so() -> None:
    box = mailbox(warm=False)
    assert [h.credits for h in said(box.handle(LearnerAlive(1), 0.0), Hello)] == [0]
    assert [c.credits for c in said(box.handle(welcome(), 0.0), Credit)] == [0]
    out = box.handle(Ready("mujoco 4", "digest"), 0.1)
    assert [(h.credits, h.engine) for h in said(out, Hello)] == [(2, "mujoco 4")]
    assert [c.credits for c in said(out, Credit)] == [2]


def test_credits_are_numbered_upwards_and_repeated_while_idle() -> None:
    box = joined()
    idle_s = IDLE_LEASES * LEASE_S
    credits_ = said((i for _, i in drive(box, 5.5 * idle_s)), Credit)
    assert len(credits_) >= 4
    assert [c.seq for c in credits_] == sorted({c.seq for c in credits_})


def test_the_learners_task_is_prepared_once() -> None:
    box = mailbox(warm=False, takes_task=True)
    box.handle(LearnerAlive(1), 0.0)
    assert of(box.handle(welcome(), 0.0), Prepare) == [Prepare(SPEC)]
    assert not of(box.handle(welcome(), 0.1), Prepare)
    box.handle(LearnerAlive(2), 1.0)
    assert not of(box.handle(welcome(2), 1.0), Prepare)


def test_what_is_meant_for_another_life_of_the_name_is_ignored() -> None:
    box = joined()
    for message in (
        trial(1, boot="boot-0000"),
        Refused(boot="boot-0000", why="not you"),
        Ack(boot="boot-0000", token=token(1), verdict=Verdict.COUNTED),
    ):
        assert not box.handle(Heard(message), 0.1)


def test_a_refusal_ends_the_worker_with_the_learners_reason() -> None:
    refused = Heard(Refused(boot=BOOT, why="name taken"))
    assert of(mailbox().handle(refused, 0.0), Quit) == [Quit(4, "name taken")]
    ended = Heard(Refused(boot=BOOT, why="the run has ended", ended=True))
    assert of(mailbox().handle(ended, 0.0), Quit) == [Quit(0, "the run has ended")]


# -- trials --------------------------------------------------------------------------------------


def test_an_attempt_is_run_once_however_often_and_whenever_it_comes() -> None:
    box = joined()
    assert of(box.handle(Heard(trial(1)), 0.0), Run) == [Run(trial(1))]
    assert not box.handle(Heard(trial(1)), 0.1)
    box.handle(Started(token(1)), 0.1)
    assert not box.handle(Heard(trial(1)), 0.2)
    assert said(box.handle(Ended(result(1)), 0.3), Result) == [result(1)]
    assert said(box.handle(Heard(trial(1)), 0.4), Result) == [result(1)]
    assert not of(box.handle(ack(1), 0.5), Run)
    assert said(box.handle(Heard(trial(1)), 0.6), Result) == [result(1)]
    box.handle(ack(1), 0.7)
    assert not said((i for _, i in drive(box, 5.0, 0.7)), Result)


def test_a_trial_that_nobody_had_room_for_is_not_taken() -> None:
    box = joined(warm=False)
    assert not box.handle(Heard(trial(1)), 0.0)
    box.handle(Ready("engine", "digest"), 0.1)
    assert of(box.handle(Heard(trial(1)), 0.2), Run)


def test_a_result_is_sent_again_ever_more_slowly_until_it_is_acknowledged() -> None:
    box = busy(1)
    out = [(0.5, i) for i in box.handle(Ended(result(1)), 0.5)]
    out += drive(box, 5.0, 0.5)
    times_s = [now_s for now_s, i in out if said([i], Result)]
    gaps_s = [b - a for a, b in pairwise(times_s)]
    assert gaps_s[0] == pytest.approx(RESEND_S_MIN, abs=1e-3)
    assert gaps_s == sorted(gaps_s)
    assert gaps_s[-1] == pytest.approx(RESEND_S_MAX, abs=1e-3)


def test_a_beat_renews_all_that_is_held_and_only_that() -> None:
    box = busy(1, 2)
    assert [r.tokens for r in said(box.handle(Beat(), 0.5), Renew)] == [[token(1), token(2)]]
    box.handle(Ended(result(1)), 0.6)
    assert not box.handle(Beat(), 0.7)
    box.handle(Started(token(2)), 0.8)
    assert [r.tokens for r in said(box.handle(Beat(), 0.9), Renew)] == [[token(2)]]


def test_without_a_beat_a_lease_is_not_renewed() -> None:
    box = busy(1)
    assert not said((i for _, i in drive(box, 9.0)), Renew)


def test_a_function_is_renewed_for_up_to_its_deadline_and_no_longer() -> None:
    box = busy(1, pulses=True)
    renewed_s = [now_s for now_s, i in drive(box, 60.0) if said([i], Renew)]
    gaps_s = [b - a for a, b in zip([0.0, *renewed_s], renewed_s, strict=False)]
    assert max(gaps_s) <= LEASE_S / 4 + 1e-3
    assert 9.0 <= max(renewed_s) <= 10.0


def test_trials_of_a_function_that_wait_behind_short_ones_are_renewed_too() -> None:
    box = busy(*range(40), pulses=True)
    out: list[Instruction] = []
    for number in range(20):
        now_s = 0.3 * number
        out += box.handle(Started(token(number)), now_s)
        out += box.handle(Tick(), now_s + 0.2)
        out += box.handle(Ended(result(number)), now_s + 0.3)
        box.handle(ack(number), now_s + 0.3)
    assert sum(token(39) in r.tokens for r in said(out, Renew)) >= 8


def test_a_trial_that_outlives_its_deadline_without_a_beat_is_given_up_with_the_process() -> None:
    for pulses, overdue_s in ((True, 10.0), (False, 10.0 + HANG_S)):
        box = busy(1, pulses=pulses)
        done = drive(box, 60.0)
        given_up_s, hung = next((s, i) for s, i in done if said([i], Result))
        assert given_up_s == pytest.approx(overdue_s, abs=1e-3)
        assert [r.kind for r in said([hung], Result)] == [OutcomeKind.ABORTED]
        last_s, last = done[-1]
        assert last == Quit(4, "trial 1 ran longer than 10 s")
        assert last_s <= overdue_s + LEAVE_S + 1e-3


def test_a_hung_trial_that_comes_back_after_all_changes_nothing() -> None:
    box = busy(1)
    box.handle(Tick(), 10.0 + HANG_S)
    assert not said(box.handle(Ended(result(1)), 11.1), Result)
    assert box.handle(ack(1), 11.2)[-1] == Quit(4, "trial 1 ran longer than 10 s")


def test_what_a_flooding_peer_sends_is_bounded() -> None:
    box = joined()
    for number in range(HELD_MAX + 10):
        box.handle(Heard(trial(number)), 0.0)
    assert len(box.held) == HELD_MAX
    for number in range(HELD_MAX):
        box.handle(Ended(result(number)), 0.0)
        box.handle(ack(number), 0.0)
    assert len(box.outbox.answered) == ANSWERED_MAX


# -- hold ----------------------------------------------------------------------------------------


def test_hold_closes_the_gate_renews_what_waits_and_resume_opens_it() -> None:
    box = joined()
    hold, resume = (Heard(Command(kind=k)) for k in (CommandKind.HOLD, CommandKind.RESUME))
    assert of(box.handle(hold, 0.0), Gate) == [Gate(is_open=False)]
    assert not of(box.handle(hold, 0.0), Gate)
    box.handle(Heard(trial(1)), 0.0)
    renewed = said((i for _, i in drive(box, 4.0)), Renew)
    assert len(renewed) >= 4
    assert of(box.handle(resume, 4.0), Gate) == [Gate(is_open=True)]


def test_a_welcome_into_a_held_run_closes_the_gate() -> None:
    box = mailbox()
    box.handle(LearnerAlive(1), 0.0)
    assert of(box.handle(welcome(held=True), 0.0), Gate) == [Gate(is_open=False)]


# -- the learner goes and comes ------------------------------------------------------------------


def test_a_new_epoch_is_greeted_and_gets_what_the_old_one_missed() -> None:
    box = busy(1, 2)
    box.handle(Ended(result(1)), 0.5)
    assert not box.handle(LearnerGone(1), 0.6)
    assert not drive(box, 5.0, 0.6)
    assert not box.handle(Beat(), 5.0)
    assert said(box.handle(LearnerAlive(2), 5.0), Hello)
    assert said(box.handle(welcome(2), 5.1), Result) == [result(1)]
    box.handle(Started(token(2)), 5.1)
    assert said(box.handle(Beat(), 5.2), Renew)


def test_the_way_to_the_same_learner_may_break_and_mend() -> None:
    box = joined()
    box.handle(LearnerGone(1), 1.0)
    assert said(box.handle(LearnerAlive(1), 1.5), Hello)
    assert said(box.handle(welcome(1), 1.6), Credit)


def test_the_end_of_an_old_epoch_that_is_seen_late_changes_nothing() -> None:
    box = joined()
    box.handle(LearnerAlive(2), 1.0)
    box.handle(welcome(2), 1.0)
    assert not box.handle(LearnerGone(1), 1.1)
    assert box.welcomed
    assert not box.handle(LearnerAlive(1), 1.2)
    box.handle(welcome(1), 1.3)
    assert box.epoch == 2


def test_a_learner_that_says_nothing_for_long_is_greeted_again() -> None:
    box = joined()
    silent_s = SILENCE_LEASES * LEASE_S
    late_s = 2 * silent_s
    greeted_s = [now_s for now_s, i in drive(box, late_s) if said([i], Hello)]
    assert greeted_s[0] == pytest.approx(silent_s, abs=1e-3)
    box.handle(Heard(Command(kind=CommandKind.RESUME)), late_s)
    assert not said((i for _, i in drive(box, late_s + LEASE_S, late_s)), Hello)


# -- leaving -------------------------------------------------------------------------------------

STOP = Heard(Command(kind=CommandKind.STOP, why="the run is complete"))


def test_an_idle_worker_leaves_at_once_when_the_run_ends() -> None:
    out = joined().handle(STOP, 1.0)
    assert [b.why for b in said(out, Bye)] == ["the run is complete"]
    assert out[-1] == Quit(0, "the run is complete")


def test_when_the_run_ends_what_runs_may_finish_for_a_while() -> None:
    box = busy(1)
    assert not box.handle(STOP, 1.0)
    assert not of(box.handle(Heard(trial(2)), 1.1), Run)
    assert said(box.handle(Ended(result(1)), 1.0 + FINISH_S / 2), Result)
    out = box.handle(ack(1), 1.0 + FINISH_S / 2)
    assert out[-1] == Quit(0, "the run is complete")


def test_when_the_run_ends_what_runs_on_is_aborted_and_then_left() -> None:
    box = busy(1)
    box.handle(STOP, 1.0)
    done = drive(box, 60.0, 1.0)
    aborted_s = next(now_s for now_s, i in done if isinstance(i, Abort))
    assert aborted_s == pytest.approx(1.0 + FINISH_S, abs=1e-3)
    assert done[-1][0] == pytest.approx(1.0 + FINISH_S + LEAVE_S, abs=1e-3)
    assert done[-1][1] == Quit(0, "the run is complete")


def test_when_the_learner_goes_after_ending_the_run_nothing_runs_on() -> None:
    box = busy(1)
    box.handle(STOP, 1.0)
    assert of(box.handle(LearnerGone(1), 1.1), Abort)
    assert box.handle(Ended(result(1)), 1.2)[-1] == Quit(0, "the run is complete")


def test_a_signal_aborts_what_runs_at_once_and_delivers_it_if_it_can() -> None:
    box = busy(1)
    assert of(box.handle(Leave(130, "interrupted"), 1.0), Abort) == [Abort("interrupted")]
    assert said(box.handle(Ended(result(1)), 1.1), Result)
    assert box.handle(ack(1), 1.2)[-1] == Quit(130, "interrupted")


def test_a_signal_does_not_wait_for_a_function() -> None:
    out = busy(1, pulses=True).handle(Leave(130, "interrupted"), 1.0)
    assert out[-1] == Quit(130, "interrupted")


def test_a_signal_before_the_learner_was_found_leaves_without_a_word() -> None:
    out = mailbox().handle(Leave(130, "interrupted"), 0.0)
    assert out == [Abort("interrupted"), Quit(130, "interrupted")]


def test_after_the_end_nothing_is_done() -> None:
    box = joined()
    box.handle(STOP, 1.0)
    assert not box.handle(Heard(trial(1)), 1.1)
    assert not box.handle(LearnerAlive(2), 1.1)


def test_a_long_reason_can_be_said() -> None:
    out = joined().handle(Leave(4, "x" * 9999), 1.0)
    assert all(encode(i.message) for i in of(out, Send))


# -- tasks on hardware -----------------------------------------------------------------------------


def test_a_task_that_rests_has_no_credit_until_it_is_ready_again() -> None:
    box = joined()
    assert [credit.credits for credit in said(box.handle(Resting(), 1.0), Credit)] == [0]
    assert of(box.handle(Heard(trial(1)), 1.1), Run) == []
    ready = box.handle(Ready("e", ""), 2.0)
    assert [credit.credits for credit in said(ready, Credit)] == [2]


def test_what_earlier_lives_owed_is_sent_under_this_boot_until_it_is_acknowledged() -> None:
    box = mailbox()
    box.keeps = True
    box.owe([replace(result(7), boot="boot-of-before")])
    box.handle(LearnerAlive(1), 0.0)
    sent = said(box.handle(welcome(), 0.1), Result)
    assert [(r.boot, r.token) for r in sent] == [(BOOT, token(7))]
    assert len(said(box.handle(Tick(), 1.0), Result)) == 1
    assert of(box.handle(ack(7), 1.1), Settled) == [Settled(token(7))]
    assert said(box.handle(Tick(), 9.0), Result) == []


def test_a_result_that_the_learner_does_not_know_is_not_settled() -> None:
    box = mailbox()
    box.keeps = True
    box.owe([result(7)])
    box.handle(LearnerAlive(1), 0.0)
    box.handle(welcome(), 0.1)
    unknown = Heard(Ack(boot=BOOT, token=token(7), verdict=Verdict.UNKNOWN))
    assert of(box.handle(unknown, 0.2), Settled) == []
    assert said(box.handle(Tick(), 9.0), Result) == [], "this life does not ask again"


@pytest.mark.parametrize("ends", [STOP, Leave(130, "interrupted")])
def test_what_needs_long_to_end_in_order_is_waited_for(ends: Event) -> None:
    box = joined()
    box.farewell_s = 60.0
    box.handle(Heard(trial(1)), 0.0)
    box.handle(Started(token(1)), 0.0)
    box.handle(ends, 1.0)
    done = drive(box, 55.0, 1.0)
    assert not any(isinstance(i, Quit) for _, i in done)
    assert said(box.handle(Ended(result(1)), 55.0), Result)
    done = drive(box, 80.0, 55.0)
    assert done[-1][0] == pytest.approx(55.0 + LEAVE_S, abs=1e-3), "acks: not so long"


def test_a_trial_past_its_deadline_counts_as_hung_only_after_its_farewell() -> None:
    box = joined()
    box.farewell_s = 60.0
    box.handle(Heard(trial(1)), 0.0)
    box.handle(Started(token(1)), 0.0)
    done = drive(box, 200.0)
    (quit_s,) = [now_s for now_s, i in done if isinstance(i, Quit)]
    assert quit_s >= 10.0 + 60.0 + HANG_S


def test_nobody_hears_what_is_settled_where_nobody_keeps_results() -> None:
    box = joined()
    box.handle(Heard(trial(1)), 0.5)
    box.handle(Ended(result(1)), 0.6)
    assert of(box.handle(ack(1), 0.7), Settled) == []
