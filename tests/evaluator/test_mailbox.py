"""The worker's decisions, without a network, a thread or a clock."""

from collections.abc import Iterable
from itertools import pairwise
from typing import Any, TypeVar

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

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
    Run,
    Send,
    Started,
    Tick,
)
from shearline.evaluator.mailbox import (
    ANSWERED_MAX,
    FINISH_S,
    HANG_S,
    HELD_MAX,
    LEAVE_S,
    RESEND_S_MAX,
    RESEND_S_MIN,
    SILENCE_LEASES,
    WAIT_S_MAX,
    Mailbox,
)
from shearline.protocol.codec import encode
from shearline.protocol.messages import (
    VERSION,
    Ack,
    Bye,
    Command,
    CommandKind,
    Credit,
    Hello,
    Message,
    OutcomeKind,
    Refused,
    Renew,
    Result,
    TaskSpec,
    Trial,
    Verdict,
    Welcome,
)

M = TypeVar("M", bound=Message)
I = TypeVar("I", bound=Instruction)  # noqa: E741 - beside M
BOOT = "boot-0001"
LEASE_S = 2.0
SPEC = TaskSpec(name="sleep-1", space={"x": ("m", 0.0, 1.0)})


def mailbox(*, warm: bool = True, takes_task: bool = False, pulses: bool = False) -> Mailbox:
    hello = Hello(
        boot=BOOT, version=VERSION, task_digest="", kind="simulator", engine="e", credits=2
    )
    return Mailbox(hello, warm=warm, takes_task=takes_task, pulses=pulses)


def welcome(epoch: int = 1, **changes: Any) -> Heard:
    facts: dict[str, Any] = {"boot": BOOT, "epoch": epoch, "task": SPEC, "lease_s": LEASE_S}
    return Heard(Welcome(**(facts | changes)))


def trial(number: int, **changes: Any) -> Trial:
    facts: dict[str, Any] = {
        "boot": BOOT,
        "epoch": 1,
        "trial": number,
        "episode": 0,
        "attempt": 1,
        "token": token(number),
        "theta": [0.5],
        "seed": number,
        "lease_s": LEASE_S,
        "deadline_s": 10.0,
    }
    return Trial(**(facts | changes))


def token(number: int) -> str:
    return f"token-{number:06}"


def result(number: int) -> Result:
    return Result(
        boot=BOOT,
        token=token(number),
        trial=number,
        kind=OutcomeKind.SUCCESS,
        cost=float(number),
        seed=number,
    )


def ack(number: int) -> Heard:
    return Heard(Ack(boot=BOOT, token=token(number), verdict=Verdict.COUNTED))


def said(out: Iterable[Instruction], kind: type[M]) -> list[M]:
    return [i.message for i in out if isinstance(i, Send) and isinstance(i.message, kind)]


def of(out: Iterable[Instruction], kind: type[I]) -> list[I]:
    return [i for i in out if isinstance(i, kind)]


def joined(**how: bool) -> Mailbox:
    box = mailbox(**how)
    box.handle(LearnerAlive(1), 0.0)
    box.handle(welcome(), 0.0)
    return box


def busy(*numbers: int, **how: bool) -> Mailbox:
    """Return a mailbox that holds these trials and runs the first."""
    box = joined(**how)
    for number in numbers:
        box.handle(Heard(trial(number)), 0.0)
    box.handle(Started(token(numbers[0])), 0.0)
    return box


def drive(box: Mailbox, until_s: float, now_s: float = 0.0) -> list[tuple[float, Instruction]]:
    """Let time pass as the postman would, and return what was done when."""
    done = []
    while now_s < until_s and not box.over:
        now_s = min(until_s, now_s + max(box.wait_s(now_s), 1e-6))
        done += [(now_s, instruction) for instruction in box.handle(Tick(), now_s)]
    return done


# -- coming --------------------------------------------------------------------------------------


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
    credits_ = said((i for _, i in drive(box, 5.0)), Credit)
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
    assert len(box.answered) == ANSWERED_MAX


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
    greeted_s = [now_s for now_s, i in drive(box, 10.0) if said([i], Hello)]
    assert greeted_s[0] == pytest.approx(SILENCE_LEASES * LEASE_S, abs=1e-3)
    box.handle(Heard(Command(kind=CommandKind.RESUME)), 10.0)
    assert not said((i for _, i in drive(box, 10.0 + LEASE_S, 10.0)), Hello)


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


# -- laws ----------------------------------------------------------------------------------------

NUMBERS = st.integers(0, 5)


class AnyStory(RuleBasedStateMachine):
    """Whatever happens in whatever order, a worker keeps to these laws."""

    @initialize(pulses=st.booleans(), warm=st.booleans())
    def start(self, *, pulses: bool, warm: bool) -> None:
        self.box = mailbox(pulses=pulses, warm=warm)
        self.now_s = 0.0
        self.ran: list[str] = []
        self.results: dict[str, Result] = {}
        self.over = False

    def tell(self, event: Event) -> None:
        out = self.box.handle(event, self.now_s)
        assert not (self.over and out)
        assert self.box.warm or not of(out, Run)
        self.ran += [run.trial.token for run in of(out, Run)]
        for sent in said(out, Message):
            encode(sent)
            assert isinstance(sent, Hello | Credit | Renew | Result | Bye)
        for sent_result in said(out, Result):
            assert self.results.setdefault(sent_result.token, sent_result) == sent_result
        self.over |= bool(of(out, Quit))
        assert not of(out, Quit) or isinstance(out[-1], Quit)

    @rule(number=NUMBERS)
    def given(self, number: int) -> None:
        self.tell(Heard(trial(number)))

    @rule(number=NUMBERS)
    def acked(self, number: int) -> None:
        self.tell(ack(number))

    @rule(epoch=st.integers(1, 3))
    def alive(self, epoch: int) -> None:
        self.tell(LearnerAlive(epoch))

    @rule(epoch=st.integers(1, 3))
    def gone(self, epoch: int) -> None:
        self.tell(LearnerGone(epoch))

    @rule(epoch=st.integers(1, 3), held=st.booleans())
    def welcomed(self, epoch: int, *, held: bool) -> None:
        self.tell(welcome(epoch, held=held))

    @rule(kind=st.sampled_from([CommandKind.HOLD, CommandKind.RESUME]))
    def commanded(self, kind: CommandKind) -> None:
        self.tell(Heard(Command(kind=kind)))

    @rule()
    def readied(self) -> None:
        self.tell(Ready("engine", "digest"))

    @rule()
    def started(self) -> None:
        if self.box.held and self.box.running is None:
            self.tell(Started(next(iter(self.box.held))))

    @rule()
    def ended(self) -> None:
        if self.box.running is not None:
            self.tell(Ended(result(int(self.box.running.token[-6:]))))

    @rule()
    def beaten(self) -> None:
        self.tell(Beat())

    @rule(passed_s=st.floats(0.0, 3.0))
    def waited(self, passed_s: float) -> None:
        self.now_s += passed_s
        self.tell(Tick())

    @rule(finish=st.booleans())
    def leaves(self, *, finish: bool) -> None:
        self.tell(Leave(130, "interrupted", finish))

    @invariant()
    def no_attempt_is_run_twice(self) -> None:
        assert len(self.ran) == len(set(self.ran))

    @invariant()
    def every_attempt_is_in_one_place(self) -> None:
        places = [*self.box.held, *self.box.unacked, *self.box.answered]
        assert len(places) == len(set(places))

    @invariant()
    def the_next_look_is_never_far_off(self) -> None:
        assert 0.0 <= self.box.wait_s(self.now_s) <= WAIT_S_MAX

    @invariant()
    def leaving_is_bounded(self) -> None:
        if self.box.leaving is not None and not self.over:
            drive_to_s = self.now_s + FINISH_S + LEAVE_S + 1e-3
            assert self.box.leaving.until_s <= drive_to_s


TestAnyStory = AnyStory.TestCase
TestAnyStory.settings = settings(max_examples=60, stateful_step_count=30, deadline=None)
