"""What the dispatcher wants done: one small value for each kind of effect.

They are carried out in the order they are listed. A :class:`Journal` always stands before
whatever tells the world about it, so whoever carries them out may group all journal entries of
several steps into one write, as long as that write comes first.
"""

from __future__ import annotations

import enum

import msgspec

from shearline.learner.dispatcher.entries import Entry
from shearline.protocol.messages import Message, Purpose


class Told(msgspec.Struct, frozen=True):
    """One outcome as the learner hears it."""

    trial: int
    cost: float
    success: bool


class Ending(enum.StrEnum):
    """How this epoch of a run ended."""

    COMPLETE = "complete"  # all episodes are closed
    STOPPED = "stopped"  # can be resumed
    FAILED = "failed"


class Instruction(msgspec.Struct, frozen=True):
    """Base of all instructions."""


class Journal(Instruction, frozen=True):
    """Write this entry where it survives the process; it is already part of the book."""

    entry: Entry


class Send(Instruction, frozen=True):
    """Send a message to one evaluator."""

    evaluator: str
    message: Message


class Broadcast(Instruction, frozen=True):
    """Send a message to all evaluators."""

    message: Message


class Publish(Instruction, frozen=True):
    """Let observers know; may be dropped."""

    message: Message


class Ask(Instruction, frozen=True):
    """Tell the learner these outcomes, in this order, then ask it for an episode.

    Attributes:
        episode: Its number.
        trials: How many trials it is to have.
        tells: Outcomes since the last ask.
        first: Number of its first trial.
        purpose: What it is for; anything but learning is about what the learner recommends.
    """

    episode: int
    trials: int
    tells: tuple[Told, ...]
    first: int
    purpose: Purpose = Purpose.LEARNING


class Say(Instruction, frozen=True):
    """Write one line to the log; ``stimulus`` is the number of the event that caused it."""

    stimulus: int
    text: str


class EndRun(Instruction, frozen=True):
    """Nothing more will be handed out: tell the learner the rest and shut down.

    Attributes:
        ending: How it ended.
        why: One sentence unless it is complete.
        tells: Outcomes that the learner has not heard yet.
    """

    ending: Ending
    why: str
    tells: tuple[Told, ...]
