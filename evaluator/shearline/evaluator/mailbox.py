"""The worker's decisions: events in, instructions out, time a parameter.

What to say to the learner and when to say it again, which trials are held, what to do when the
learner is silent, restarts, or ends the run, and when a trial counts as hung. It opens no
session, starts no thread and reads no clock; the postman (:mod:`shearline.evaluator.postman`) and
the worker carry its instructions out.
"""

from __future__ import annotations

from dataclasses import dataclass, field

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
)
from shearline.evaluator.outbox import RESEND_S_MAX, RESEND_S_MIN, Outbox
from shearline.protocol.messages import (
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
    Trial,
    Verdict,
    Welcome,
    clip,
)

#: Leases between renewals while a trial runs, and between signs of life while idle: who holds
#: nothing delays nothing, and hundreds that wait for an update must not keep a core busy.
RENEW_LEASES = 0.25
IDLE_LEASES = 1.5

#: Leases of silence after which a learner is asked whether it still knows us. It seldom matters: a
#: learner that started again is another life, which is greeted at once, and one that took us for
#: gone hears the next credit.
SILENCE_LEASES = 10.0

#: How long what runs may finish once the learner ends the run, and how long leaving may take [s].
FINISH_S = 2.0
LEAVE_S = 1.0

#: A trial loop that beats notices its deadline itself; one that did not by then is hung [s].
HANG_S = 1.0

#: Attempts held at once, whatever a peer sends.
HELD_MAX = 1024

#: Longest wait for an event; only bounds how late a timer can be [s].
WAIT_S_MAX = 0.5

NEVER_S = float("inf")


@dataclass(slots=True)
class _Running:
    """The trial that runs, and when it counts as hung."""

    token: str
    overdue_s: float


@dataclass(slots=True)
class _Leaving:
    """How and until when this process leaves."""

    code: int
    why: str
    abort_s: float
    until_s: float
    aborted: bool = False


@dataclass(slots=True)
class Mailbox:
    """What one boot of one evaluator knows about one run.

    Args:
        hello: How it introduces itself, with the credits it will have once it is warm.
        takes_task: It runs whatever built-in task the learner names.
        pulses: The task cannot beat (it is one call of the user's function), so leases are
            renewed for it while it runs, up to its deadline and no longer.
        keeps: Somebody keeps results until they are acknowledged, and wants to hear when.
        farewell_s: How long what runs may take to end in order once it was asked to [s].
    """

    hello: Hello
    takes_task: bool = False
    pulses: bool = False
    keeps: bool = False
    farewell_s: float = 0.0
    lease_s: float = 2.0
    epoch: int | None = None
    welcomed: bool = False
    warm: bool = False
    held: dict[str, Trial] = field(default_factory=dict)
    outbox: Outbox = field(default_factory=Outbox)
    running: _Running | None = None
    leaving: _Leaving | None = None
    over: bool = False
    _is_open: bool = True
    _prepared: bool = False
    _credit_seq: int = 0
    _hello_s: float = NEVER_S
    _hello_delay_s: float = RESEND_S_MIN
    _life_s: float = NEVER_S
    _out: list[Instruction] = field(default_factory=list)

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        """Advance by one event and by the time that has passed.

        Args:
            event: What happened.
            now_s: When, on any clock that never goes backwards [s].

        Returns:
            What is to be done, in this order. Nothing after a :class:`Quit`.
        """
        if self.over:
            return []
        self._out = []
        match event:  # what comes with every trial first
            case Heard(message):
                self._heard(message, now_s)
            case Started(token):
                self._started(token, now_s)
            case Ended(result):
                self._ended(result, now_s)
            case Beat() if self.running is not None:
                self._renew(now_s)
            case LearnerAlive(epoch):
                self._alive(epoch, now_s)
            case LearnerGone(epoch):
                self._gone(epoch, now_s)
            case Ready() | Resting():
                self._ready(event, now_s)
            case Leave(code, why, finish):
                self._leave(code, why, now_s, finish=finish)
            case _:
                pass
        self._let_time_pass(now_s)
        return self._out

    def owe(self, results: list[Result]) -> None:
        """Take over results of earlier lives; they are sent until they are acknowledged."""
        for result in results:
            self.outbox.put(replace(result, boot=self.hello.boot), now_s=0.0)

    def wait_s(self, now_s: float) -> float:
        """Return how long nothing need be done [s], at most :data:`WAIT_S_MAX`."""
        due_s = [self._hello_s, self._life_s]
        if self.welcomed:
            due_s.append(self.outbox.next_s())
        if self.running is not None:
            due_s.append(self.running.overdue_s)
        if self.leaving is not None:
            due_s.append(self.leaving.until_s)
            due_s.append(NEVER_S if self.leaving.aborted else self.leaving.abort_s)
        return min(WAIT_S_MAX, max(0.0, min(due_s) - now_s))

    # -- the learner comes and goes -------------------------------------------------------------

    def _alive(self, epoch: int, now_s: float) -> None:
        if self.epoch is None or epoch > self.epoch:
            self.epoch = epoch
            self.welcomed = False
            self._ask(now_s)

    def _gone(self, epoch: int, now_s: float) -> None:
        if epoch != self.epoch:
            return
        self.epoch = None
        self.welcomed = False
        self._hello_s = self._life_s = NEVER_S
        if self.leaving is not None:
            # Nobody is left to take a result: what still runs is for nothing.
            self.leaving.abort_s = now_s

    def _ask(self, now_s: float) -> None:
        """Say hello now, and again until an answer comes."""
        self._hello_s, self._hello_delay_s = now_s, RESEND_S_MIN

    # -- what the learner says ------------------------------------------------------------------

    def _heard(self, message: Message, now_s: float) -> None:
        if getattr(message, "boot", self.hello.boot) != self.hello.boot:
            return  # meant for an earlier life of this name
        if self.welcomed:
            self._hello_s = now_s + SILENCE_LEASES * self.lease_s
            self._hello_delay_s = RESEND_S_MIN
        match message:
            case Trial(counted=counted):
                for token in counted:
                    self._acked(token)
                self._given(message, now_s)
            case Welcome():
                self._welcome(message, now_s)
            case Refused(why=why, ended=ended):
                self._leave(0 if ended else 4, why, now_s, finish=False)
            case Ack(token=token, verdict=verdict):
                self._acked(token, verdict)
            case Command(kind=CommandKind.STOP, why=why):
                self._leave(0, why or "the run has ended", now_s, finish=True)
            case Command(kind=kind):
                self._open(kind is CommandKind.RESUME, now_s)
            case _:
                pass

    def _welcome(self, message: Welcome, now_s: float) -> None:
        known = self.welcomed and message.epoch == self.epoch
        if self.epoch is not None and message.epoch < self.epoch:
            return
        self.welcomed, self.epoch, self.lease_s = True, message.epoch, message.lease_s
        self._hello_s = now_s + SILENCE_LEASES * self.lease_s
        self._open(not message.held, now_s)
        if self.takes_task and not self._prepared:
            self._prepared = True
            self._out.append(Prepare(message.task))
        if not known:
            self._show_life(now_s)
            self.outbox.all_again(now_s)

    def _open(self, is_open: bool, now_s: float) -> None:  # noqa: FBT001 - what it is about
        if is_open != self._is_open:
            self._is_open = is_open
            self._out.append(Gate(is_open))
            self._renew_for_the_held(now_s)

    def _given(self, trial: Trial, now_s: float) -> None:
        """Take a trial once, however often it comes."""
        if self.outbox.again(trial.token, now_s):
            return
        if trial.token not in self.held and self._has_room():
            self.held[trial.token] = trial
            self._out.append(Run(trial))
            self._renew_for_the_held(now_s)

    def _renew_for_the_held(self, now_s: float) -> None:
        """See that what waits behind a closed gate is renewed in time, for no trial loop will."""
        if self.held and not self._is_open:
            self._life_s = min(self._life_s, now_s + RENEW_LEASES * self.lease_s)

    def _has_room(self) -> bool:
        return self.warm and self.leaving is None and len(self.held) < HELD_MAX

    def _acked(self, token: str, verdict: Verdict = Verdict.COUNTED) -> None:
        # Who does not know a result has no say in whether it is kept.
        if self.outbox.acked(token) and self.keeps and verdict is not Verdict.UNKNOWN:
            self._out.append(Settled(token))

    # -- what the trial's thread says -----------------------------------------------------------

    def _ready(self, event: Ready | Resting, now_s: float) -> None:
        """Have trials come, or come no more; say so at once."""
        said = self.hello
        self.warm = isinstance(event, Ready)
        if isinstance(event, Ready):
            self.hello = replace(said, engine=event.engine, task_digest=event.task_digest)
        if self.welcomed:
            if self.hello != said:
                self._send(self._greeting())
            self._show_life(now_s)

    def _started(self, token: str, now_s: float) -> None:
        trial = self.held.get(token)
        if trial is not None:
            grace_s = 0.0 if self.pulses else HANG_S + self.farewell_s
            self.running = _Running(token, now_s + trial.deadline_s + grace_s)
            if self.pulses:
                self._life_s = min(self._life_s, now_s + RENEW_LEASES * self.lease_s)

    def _ended(self, result: Result, now_s: float) -> None:
        if self.held.pop(result.token, None) is None:
            return  # given up as hung before
        if self.running is not None and self.running.token == result.token:
            self.running = None
            if self.welcomed:
                self._life_s = min(self._life_s, now_s + IDLE_LEASES * self.lease_s)
        self.outbox.put(result, now_s)
        if self.leaving is not None and not self.held:  # only an acknowledgement is waited for
            until_s = max(now_s, self.leaving.abort_s) + LEAVE_S
            self.leaving.until_s = min(self.leaving.until_s, until_s)

    # -- time -----------------------------------------------------------------------------------

    def _let_time_pass(self, now_s: float) -> None:
        if self.running is not None and now_s >= self.running.overdue_s:
            self._give_up(self.running, now_s)
        if now_s >= self._hello_s and self.epoch is not None:
            self._send(self._greeting())
            self._hello_s = now_s + self._hello_delay_s
            self._hello_delay_s = min(2 * self._hello_delay_s, RESEND_S_MAX)
        if self.welcomed and now_s >= self._life_s:
            self._show_life(now_s)
        if self.welcomed:
            for result in self.outbox.due(now_s):
                self._send(result)
        if self.leaving is not None:
            self._go(self.leaving, now_s)

    def _greeting(self) -> Hello:
        return self.hello if self.warm else replace(self.hello, credits=0)

    def _show_life(self, now_s: float) -> None:
        """Renew what is held if no trial loop will, else say that we are there."""
        if self.held and (self.pulses or not self._is_open):
            self._renew(now_s)
        elif self.running is None:
            self._credit_seq += 1
            credits_ = self.hello.credits if self.warm and self.leaving is None else 0
            self._send(Credit(boot=self.hello.boot, seq=self._credit_seq, credits=credits_))
            self._life_s = now_s + IDLE_LEASES * self.lease_s
        else:
            self._life_s = NEVER_S

    def _renew(self, now_s: float) -> None:
        if self.welcomed and self.held:
            self._send(Renew(boot=self.hello.boot, tokens=list(self.held)))
        self._life_s = now_s + RENEW_LEASES * self.lease_s

    def _give_up(self, running: _Running, now_s: float) -> None:
        """Report a hung trial; only a new process can help this one."""
        running.overdue_s = NEVER_S
        trial = self.held.pop(running.token)
        why = f"ran longer than {trial.deadline_s:g} s"
        aborted = Result(
            boot=self.hello.boot,
            token=trial.token,
            trial=trial.trial,
            kind=OutcomeKind.ABORTED,
            cost=0.0,
            seed=trial.seed,
            engine=self.hello.engine,
            wall_s=trial.deadline_s,
            why=why,
        )
        self.outbox.put(aborted, now_s)
        self._leave(4, f"trial {trial.trial} {why}", now_s, finish=False)

    # -- leaving --------------------------------------------------------------------------------

    def _leave(self, code: int, why: str, now_s: float, *, finish: bool) -> None:
        if self.leaving is None:
            abort_s = now_s + FINISH_S if finish and self.running is not None else now_s
            self.leaving = _Leaving(code, why, abort_s, abort_s + LEAVE_S + self.farewell_s)

    def _go(self, leaving: _Leaving, now_s: float) -> None:
        if now_s >= leaving.abort_s and not leaving.aborted:
            leaving.aborted = True
            leaving.until_s = now_s + LEAVE_S + (self.farewell_s if self.held else 0.0)
            self._out.append(Abort(leaving.why))
        # A function cannot be aborted, so nobody waits for it; what is held goes back with a bye.
        idle = not self.held or (leaving.aborted and self.pulses)
        settled = idle and not (self.outbox.unacked and self.welcomed)
        if settled or now_s >= leaving.until_s:
            if self.welcomed:
                self._send(Bye(boot=self.hello.boot, why=clip(leaving.why)))
            self._out.append(Quit(leaving.code, leaving.why))
            self.over = True

    def _send(self, message: Message) -> None:
        self._out.append(Send(message))
