"""What the dispatcher can be told: one small value for each kind of event.

Events carry no time; the time they are handled at is given beside them. Evaluators are named by
the chunk of the key that a message came on, never by a field of the message.
"""

from __future__ import annotations

import msgspec

from shearline.protocol.messages import Bye, CommandKind, Credit, Hello, Renew, Result


class Event(msgspec.Struct, frozen=True):
    """Base of all events."""


class Begin(Event, frozen=True):
    """The learner process is up and reads its queue; the first event of each epoch."""


class Tick(Event, frozen=True):
    """Time has passed; to be sent at least every quarter of a lease."""


class HelloReceived(Event, frozen=True):
    """An evaluator introduced itself."""

    evaluator: str
    message: Hello


class CreditReceived(Event, frozen=True):
    """An evaluator said how many attempts it will hold."""

    evaluator: str
    message: Credit


class RenewReceived(Event, frozen=True):
    """An evaluator renewed leases."""

    evaluator: str
    message: Renew


class ResultReceived(Event, frozen=True):
    """An evaluator reported how an attempt ended."""

    evaluator: str
    message: Result


class ByeReceived(Event, frozen=True):
    """An evaluator left on purpose."""

    evaluator: str
    message: Bye


class EvaluatorGone(Event, frozen=True):
    """The network saw the liveliness token of one boot disappear: a hint, not the truth."""

    evaluator: str
    boot: str


class Planned(msgspec.Struct, frozen=True):
    """One trial as the learner proposed it: its number, tuple in task units and seed."""

    trial: int
    theta: list[float]
    seed: int


class ProposalsReady(Event, frozen=True):
    """The learner answered an ask."""

    episode: int
    trials: list[Planned]


class LearnerFailed(Event, frozen=True):
    """The learner could not answer an ask, and why."""

    why: str


class OperatorCommand(Event, frozen=True):
    """The operator wants the run held, resumed or stopped."""

    kind: CommandKind
    why: str = ""
