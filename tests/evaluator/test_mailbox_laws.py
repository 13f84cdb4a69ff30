"""Whatever is said to a mailbox in whatever order, it keeps to its laws."""

from evaluator.mail_kit import ack, mailbox, of, result, said, trial, welcome
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from shearline.evaluator.mail import (
    Beat,
    Ended,
    Event,
    Heard,
    LearnerAlive,
    LearnerGone,
    Leave,
    Quit,
    Ready,
    Run,
    Started,
    Tick,
)
from shearline.evaluator.mailbox import (
    FINISH_S,
    LEAVE_S,
    WAIT_S_MAX,
)
from shearline.protocol.codec import encode
from shearline.protocol.messages import (
    Bye,
    Command,
    CommandKind,
    Credit,
    Hello,
    Message,
    Renew,
    Result,
)

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
        places = [*self.box.held, *self.box.outbox.unacked, *self.box.outbox.answered]
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
