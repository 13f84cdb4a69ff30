"""A mailbox and what may be said to it, in a word each."""

from collections.abc import Iterable
from typing import Any, TypeVar

from shearline.evaluator.mail import (
    Heard,
    Instruction,
    LearnerAlive,
    Send,
    Started,
    Tick,
)
from shearline.evaluator.mailbox import (
    Mailbox,
)
from shearline.protocol.messages import (
    VERSION,
    Ack,
    Hello,
    Message,
    OutcomeKind,
    Result,
    Trial,
    Verdict,
    Welcome,
)
from shearline.protocol.task import TaskSpec

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
