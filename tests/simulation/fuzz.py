"""Messages spoilt in every way, told to a learner and to an evaluator in the middle of a run.

Whatever comes is a message or one :class:`ProtocolError`, on any key. Of those that are messages
after all, the ones whose sender could not have sent them (a token that was not issued to it, a boot
that is another's) change nothing. The others may change what their sender may change; they are
told to a copy, which must stay sound, and a crowded inbox lets them in.

``PYTHONPATH=tests python -m simulation.fuzz [COUNT [SEED]]`` says how fast that goes.
"""

from __future__ import annotations

import functools
import logging
import math
import pickle
import random
import secrets
import sys
import time
from collections import Counter
from typing import NamedTuple

import msgspec
from simulation.lab import Lab
from simulation.promises import durable

from shearline.evaluator.mail import Heard, LearnerAlive, Ready, Tick
from shearline.evaluator.mailbox import Mailbox
from shearline.learner.dispatcher import Dispatcher, check
from shearline.learner.dispatcher.desk import Desk
from shearline.learner.dispatcher.events import (
    ByeReceived,
    CreditReceived,
    Event,
    RenewReceived,
    ResultReceived,
)
from shearline.learner.dispatcher.instructions import Journal
from shearline.learner.run.doorman import Doorman
from shearline.learner.run.incoming import Incoming
from shearline.protocol.codec import TO_EVALUATOR, decode, encode
from shearline.protocol.errors import ProtocolError
from shearline.protocol.intake import Arrival
from shearline.protocol.keys import Keys
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
    Trial,
    Verdict,
    Welcome,
)

KEYS = Keys("fuzz")

#: Evaluators of the learner that is told everything; the last one has left.
NAMES = ("a", "b", "c")

#: Keys that are nobody's, and some that are no keys.
STRAY = (
    f"{KEYS.root}/ev/nobody/result", f"{KEYS.root}/ev/a/trial", f"{KEYS.root}/ev/a/x",
    f"{KEYS.root}/ev/-/hello", f"{KEYS.root}/all/cmd", f"{KEYS.root}/obs/status", KEYS.root,
    "shearline/@v2/fuzz/ev/a/hello", "", "/", "ev",
)  # fmt: skip

Said = tuple[str, bytes]


class Tally(NamedTuple):
    """What became of the messages.

    Attributes:
        refused: Not of the protocol, or on no key of it.
        harmless: Messages that could not be their sender's, and changed nothing.
        allowed: Messages that may have an effect, told to a copy.
        let_in: Those that a crowded inbox would have taken.
    """

    refused: int
    harmless: int
    allowed: int
    let_in: int


class HexLab(Lab):
    """A lab whose tokens look like those of a run."""

    def _token(self) -> str:
        return secrets.token_hex(16)


class Fuzz:
    """A learner and an evaluator in mid-run, and all that may be said to them.

    Args:
        seed: Decides what becomes of the messages; tokens are random all the same.
    """

    def __init__(self, seed: int) -> None:
        self.dice = random.Random(seed)
        lab = _lab()
        self.desk, self.rules = lab.dispatcher.desk, lab.rules
        self.corpus = [*_said_by_evaluators(self.desk), *_said_by_the_operator()]
        self.keys = [*{key for key, _ in self.corpus}, *STRAY]
        self.mailbox = _mailbox()
        self.letters = _letters(self.mailbox)
        self._dispatcher = lab.dispatcher
        self._now_s = lab.now_s
        self._rest = pickle.dumps(self.mailbox)
        self._before = _facts(self.desk)
        self._desk = _frozen(self.desk)

    def run(self, count: int) -> Tally:
        """Tell so many mutants to the learner, and as many again to the evaluator."""
        became: Counter[str] = Counter()
        incoming, doorman = Incoming(), Doorman(self.desk)
        for _ in range(count):
            arrival = Arrival(*self._mutant())
            event, is_let_in = incoming.event(arrival), doorman.knows(arrival)
            became[self._told(event)] += 1
            became["let in"] += is_let_in
            if isinstance(event, ResultReceived | CreditReceived):
                assert is_let_in or not may_act(event, self.desk), arrival
            self._write_to_the_evaluator()
        assert _facts(self.desk) == self._before
        return Tally(became["refused"], became["harmless"], became["allowed"], became["let in"])

    def _mutant(self) -> Said:
        """Return a message in which something was changed, mostly on its own key."""
        key, payload = self.dice.choice(self.corpus)
        if self.dice.random() < 0.25:
            key = self.dice.choice(self.keys)
        _, other = self.dice.choice(self.corpus)
        return key, mutate(payload, other, self.dice)

    def _told(self, event: Event | None) -> str:
        """Tell an event to the learner; return what became of it."""
        if event is None:
            return "refused"
        if may_act(event, self.desk):
            copy = Dispatcher(self.rules, _token, self.desk.book)
            copy.desk = _thawed(self._desk, self.desk)
            copy.handle(event, self._now_s)
            check(copy.desk)
            return "allowed"
        out = self._dispatcher.handle(event, self._now_s)
        assert not [i for i in out if isinstance(i, Journal)], event
        assert _facts(self.desk) == self._before, event
        return "harmless"

    def _write_to_the_evaluator(self) -> None:
        _, other = self.dice.choice(self.letters)
        mutant = mutate(self.dice.choice(self.letters)[1], other, self.dice)
        try:
            message = decode(mutant, *TO_EVALUATOR)
        except ProtocolError:
            return
        mailbox = pickle.loads(self._rest)
        out = mailbox.handle(Heard(message), 1.0)
        if getattr(message, "boot", mailbox.hello.boot) != mailbox.hello.boot:
            assert out == []
            assert mailbox == self.mailbox


def may_act(event: Event, desk: Desk) -> bool:
    """Tell whether the sender of a message may have an effect by it."""
    match event:
        case ResultReceived(name, Result(token=token)):
            attempt = desk.book.attempts.get(token)
            return attempt is not None and attempt.evaluator == name
        case RenewReceived(name, Renew(boot=boot, tokens=tokens)) if any(
            (attempt := desk.book.attempts.get(token)) is not None
            and (attempt.evaluator, attempt.boot) == (name, boot)
            for token in tokens
        ):
            return True  # a boot that was replaced may still run what it was given
        case RenewReceived(name, message) | CreditReceived(name, message):
            known = desk.roster.get(name)
            return known is not None and known.boot == message.boot
        case ByeReceived(name, Bye(boot=boot)):
            known = desk.roster.get(name)
            held = desk.book.held_by.get(name, ())
            lives = {desk.book.attempts[token].boot for token in held}
            return boot in lives or (known is not None and known.boot == boot)
    return True  # anyone may introduce itself; orders are what access control is for


def mutate(data: bytes, other: bytes, dice: random.Random) -> bytes:
    """Return a message with something changed: a field or two, or one to four pieces of it."""
    if dice.random() < 0.4:
        return _with_fields_of(data, other, dice)
    mutant = bytearray(data)
    for _ in range(dice.randint(1, 4)):
        at = dice.randrange(len(mutant) + 1)
        match dice.randrange(7):
            case 0:
                mutant[at : at + 1] = dice.randbytes(1)
            case 1 if at < len(mutant):
                mutant[at] ^= 1 << dice.randrange(8)
            case 2:
                del mutant[at : at + dice.randint(1, 8)]
            case 3:
                mutant[at:at] = dice.randbytes(dice.randint(1, 4))
            case 4:
                mutant[at:at] = mutant[at : at + dice.randint(1, 16)]
            case 5:  # what stands there in another message
                end = at + dice.randint(1, 40)
                mutant[at:end] = other[at:end]
            case _:
                mutant[at:] = other[dice.randrange(len(other)) :]
    return bytes(mutant)


#: What may stand where something else should.
_ODD: tuple[object, ...] = (
    None, True, -1, 0, 2**63, 1.5, math.nan, "", "f" * 32, "x" * 2000, b"", [], ["f" * 32] * 1025,
    {}, {"": {}},
)  # fmt: skip


def _with_fields_of(data: bytes, other: bytes, dice: random.Random) -> bytes:
    """Return a message of which some fields have the values of another's, or odd ones."""
    fields, foreign = _fields(data), _fields(other)
    for _ in range(dice.randint(1, 2)):
        name = dice.choice(list(fields))
        if name in foreign and dice.random() < 0.8:
            fields[name] = foreign[name]
        else:
            fields[name] = dice.choice(_ODD)
    return msgspec.msgpack.encode(fields)


def _fields(data: bytes) -> dict[str, object]:
    return msgspec.msgpack.decode(data, type=dict[str, object])


def main(count: int, seed: int) -> None:
    """Spoil so many messages for each side and say how many CPU seconds it took."""
    logging.getLogger("shearline.learner").setLevel(logging.ERROR)
    began_s = time.process_time()
    tally = Fuzz(seed).run(count)
    took_s = time.process_time() - began_s
    sys.stdout.write(
        f"{count} mutants for each side: {tally}, {count / took_s:.0f} per CPU second\n"
    )


# -- the two ends --------------------------------------------------------------------------------


def _lab() -> Lab:
    """Return a run in which trials are counted, lapsed, held twice and pending."""
    lab = HexLab(trials=8)
    lab.propose()
    for name in NAMES:
        lab.hello(name, _boot(name))
    first, second = lab.dispatcher.book.held_by["a"]
    lab.renew("a", second, boot=_boot("a"))
    lab.result("a", first)
    lab.gone("b", _boot("b"))
    lab.hello("b", "second-life-of-b")
    lab.bye("c", _boot("c"))
    return lab


def _said_by_evaluators(desk: Desk) -> list[Said]:
    """Return what each evaluator might say, for every token that was ever issued to it."""
    said: list[tuple[str, Message]] = []
    for known in desk.roster:
        tokens = [t for t, a in desk.book.attempts.items() if a.evaluator == known.name]
        boot = known.boot
        said += [
            (known.name, message)
            for message in (
                Hello(boot=boot, version=VERSION, task_digest="", kind="function", engine="",
                      credits=2),
                Credit(boot=boot, seq=7, credits=2),
                Renew(boot=boot, tokens=tokens),
                Bye(boot=boot, why="enough"),
                *(_result(boot, token, kind) for token in tokens for kind in OutcomeKind),
            )
        ]  # fmt: skip
    return [(KEYS.up(name, message), encode(message)) for name, message in said]


def _said_by_the_operator() -> list[Said]:
    return [(KEYS.op_cmd(), encode(Command(kind=kind, why="x"))) for kind in CommandKind]


def _mailbox() -> Mailbox:
    """Return an evaluator that holds two trials of which it runs one."""
    hello = Hello(
        boot=_boot("a"), version=VERSION, task_digest="", kind="function", engine="", credits=2
    )
    mailbox = Mailbox(hello, warm=True)
    mailbox.handle(LearnerAlive(1), 0.0)
    for _, letter in _letters(mailbox)[:3]:
        mailbox.handle(Heard(decode(letter, *TO_EVALUATOR)), 0.5)
    mailbox.handle(Ready("fuzz", ""), 1.0)
    assert mailbox.handle(Tick(), 1.0) == []
    return mailbox


def _letters(mailbox: Mailbox) -> list[Said]:
    """Return what the learner might say to an evaluator."""
    boot = mailbox.hello.boot
    trials = [
        Trial(boot=boot, epoch=1, trial=n, episode=0, attempt=1, token=f"{n:032x}", theta=[0.5],
              seed=n, lease_s=2.0, deadline_s=8.0)
        for n in range(3)
    ]  # fmt: skip
    messages: tuple[Message, ...] = (
        Welcome(boot=boot, epoch=1, task=HexLab().rules.task, lease_s=2.0),
        *trials,
        Ack(boot=boot, token=trials[0].token, verdict=Verdict.COUNTED),
        Refused(boot=boot, why="no"),
        *(Command(kind=kind) for kind in CommandKind),
    )
    return [(KEYS.down("a", message), encode(message)) for message in messages]


def _result(boot: str, token: str, kind: OutcomeKind) -> Result:
    return Result(boot=boot, token=token, trial=0, kind=kind, cost=1.0, seed=0)


def _boot(name: str) -> str:
    return f"boot-of-{name}"


# -- state ---------------------------------------------------------------------------------------


def _facts(desk: Desk) -> str:
    """Return all that a message could change but the counts of what was of no use."""
    told = (durable(desk.book), desk.leases, list(desk.roster), desk.state, desk.asking, desk.crew)
    return repr(told)


_token = functools.partial(secrets.token_hex, 16)


def _frozen(desk: Desk) -> bytes:
    facts = {k: v for k, v in vars(desk).items() if k not in {"rules", "token", "out"}}
    return pickle.dumps(facts)


def _thawed(frozen: bytes, like: Desk) -> Desk:
    """Return a copy that is nobody else's."""
    desk = Desk.__new__(Desk)
    vars(desk).update(pickle.loads(frozen))
    desk.rules, desk.token, desk.out = like.rules, _token, []
    return desk


if __name__ == "__main__":
    chosen = [int(argument) for argument in sys.argv[1:]]
    main(chosen[0] if chosen else 1_000_000, chosen[1] if len(chosen) > 1 else 0)
