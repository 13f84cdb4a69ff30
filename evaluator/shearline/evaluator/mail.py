"""What goes into the mailbox and what comes out: one small value for each event and instruction.

Events carry no time; the time they are handled at is given beside them.
"""

from __future__ import annotations

import msgspec

from shearline.protocol.messages import Message, Result, Trial
from shearline.protocol.task import TaskSpec

# -- events --------------------------------------------------------------------------------------


class LearnerAlive(msgspec.Struct, frozen=True):
    """One life of the run's learner is there."""

    epoch: int


class LearnerGone(msgspec.Struct, frozen=True):
    """One life of the run's learner ended, or the way to it did."""

    epoch: int


class Heard(msgspec.Struct, frozen=True):
    """The learner said something."""

    message: Message


class Ready(msgspec.Struct, frozen=True):
    """The task is warm: trials may come."""

    engine: str
    task_digest: str


class Resting(msgspec.Struct, frozen=True):
    """No trials may come until there is a :class:`Ready` again."""


class Started(msgspec.Struct, frozen=True):
    """The trial of this token runs."""

    token: str


class Beat(msgspec.Struct, frozen=True):
    """The loop of the running trial is alive."""


class Ended(msgspec.Struct, frozen=True):
    """An attempt ended like this."""

    result: Result


class Leave(msgspec.Struct, frozen=True):
    """This process is to end, with this exit code; ``finish`` lets what runs come to its end."""

    code: int
    why: str
    finish: bool = False


class Tick(msgspec.Struct, frozen=True):
    """Nothing happened for a while."""


Event = LearnerAlive | LearnerGone | Heard | Ready | Resting | Started | Beat | Ended | Leave | Tick


# -- instructions --------------------------------------------------------------------------------


class Send(msgspec.Struct, frozen=True):
    """Say this to the learner."""

    message: Message


class Prepare(msgspec.Struct, frozen=True):
    """Load and warm the task that the learner named."""

    task: TaskSpec


class Run(msgspec.Struct, frozen=True):
    """Run this trial when those before it have ended."""

    trial: Trial


class Gate(msgspec.Struct, frozen=True):
    """Whether a trial may begin."""

    is_open: bool


class Abort(msgspec.Struct, frozen=True):
    """End the running trial at its next beat, and begin no other."""

    why: str


class Settled(msgspec.Struct, frozen=True):
    """The learner has the result of this token, or never wants it."""

    token: str


class Quit(msgspec.Struct, frozen=True):
    """It is over."""

    code: int
    why: str


Instruction = Send | Prepare | Run | Gate | Abort | Settled | Quit
