"""What goes into the mailbox and what comes out: one small value for each event and instruction.

Events carry no time; the time they are handled at is given beside them.
"""

from __future__ import annotations

from dataclasses import dataclass

from shearline.protocol.messages import Message, Result, TaskSpec, Trial

# -- events --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class LearnerAlive:
    """One life of the run's learner is there."""

    epoch: int


@dataclass(frozen=True, slots=True)
class LearnerGone:
    """One life of the run's learner ended, or the way to it did."""

    epoch: int


@dataclass(frozen=True, slots=True)
class Heard:
    """The learner said something."""

    message: Message


@dataclass(frozen=True, slots=True)
class Ready:
    """The task is warm: trials may come."""

    engine: str
    task_digest: str


@dataclass(frozen=True, slots=True)
class Started:
    """The trial of this token runs."""

    token: str


@dataclass(frozen=True, slots=True)
class Beat:
    """The loop of the running trial is alive."""


@dataclass(frozen=True, slots=True)
class Ended:
    """An attempt ended like this."""

    result: Result


@dataclass(frozen=True, slots=True)
class Leave:
    """This process is to end, with this exit code; ``finish`` lets what runs come to its end."""

    code: int
    why: str
    finish: bool = False


@dataclass(frozen=True, slots=True)
class Tick:
    """Nothing happened for a while."""


Event = LearnerAlive | LearnerGone | Heard | Ready | Started | Beat | Ended | Leave | Tick


# -- instructions --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Send:
    """Say this to the learner."""

    message: Message


@dataclass(frozen=True, slots=True)
class Prepare:
    """Load and warm the task that the learner named."""

    task: TaskSpec


@dataclass(frozen=True, slots=True)
class Run:
    """Run this trial when those before it have ended."""

    trial: Trial


@dataclass(frozen=True, slots=True)
class Gate:
    """Whether a trial may begin."""

    is_open: bool


@dataclass(frozen=True, slots=True)
class Abort:
    """End the running trial at its next beat, and begin no other."""

    why: str


@dataclass(frozen=True, slots=True)
class Quit:
    """It is over."""

    code: int
    why: str


Instruction = Send | Prepare | Run | Gate | Abort | Quit
