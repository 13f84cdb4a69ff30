"""Key expressions: where each message travels, and whose it is.

A key is the only identity there is: access control ties an evaluator to its chunk of the key, so
no payload field ever says who is speaking. ``@v1`` is a verbatim chunk: no wildcard matches it,
hence another version of the protocol, or a stray ``**``, never overhears this one. Sessions and
messages' contents are not known here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from shearline.protocol.errors import ConfigError, ProtocolError
from shearline.protocol.messages import Message

#: Everything of Shearline is under here, spelled in every subscription and access rule.
ROOT = "shearline/@v1"

#: Liveliness of the learner of any run: how a client finds out what there is to join.
ANY_LEARNER = f"{ROOT}/*/live/learner/*"

#: What evaluators say, one key each; the topic is the message's tag.
UP_TOPICS = ("hello", "credit", "renew", "result", "bye")

#: What is said to one evaluator; welcomes, refusals and commands share ``cmd``.
DOWN_TOPICS = ("trial", "ack", "cmd")

#: Stands where an evaluator's name would; none can have it.
NOBODY = "-"

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
_CHUNK = re.compile(r"[A-Za-z0-9_.-]{1,64}")


def check_name(name: str, what: str = "name") -> str:
    """Return a run's or evaluator's name if it can stand in a key.

    Raises:
        ConfigError: If it cannot.
    """
    if not _NAME.fullmatch(name):
        raise ConfigError(
            f"expected a {what} of 1 to 64 letters, digits, '_', '-' or '.', starting with a"
            f" letter or digit, got {name[:80]!r}: choose another"
        )
    return name


@dataclass(frozen=True, slots=True)
class Address:
    """A key taken apart.

    Attributes:
        run: Name of the run.
        topic: ``"hello"``, ``"trial"``, ``"all/cmd"``, ``"op/cmd"``, ``"live/ev"``,
            ``"live/learner"``, ``"obs/trace"``, ...
        evaluator: Whose key it is, ``""`` where it is nobody's.
        life: Boot of a live evaluator or epoch of a live learner, else ``""``.
    """

    run: str
    topic: str
    evaluator: str = ""
    life: str = ""


@dataclass(frozen=True, slots=True)
class Keys:
    """The keys of one run.

    Raises:
        ConfigError: If the run's name cannot stand in a key.
    """

    run: str

    def __post_init__(self) -> None:
        check_name(self.run, "run name")

    @property
    def root(self) -> str:
        """What all keys of the run begin with."""
        return f"{ROOT}/{self.run}"

    def up(self, evaluator: str, message: Message) -> str:
        """Return the key on which an evaluator says this message to the learner."""
        return f"{self.root}/ev/{evaluator}/{topic(message, UP_TOPICS)}"

    def down(self, evaluator: str, message: Message) -> str:
        """Return the key on which the learner says this message to one evaluator."""
        return f"{self.root}/ev/{evaluator}/{topic(message, DOWN_TOPICS)}"

    def all_cmd(self) -> str:
        """Return the key of commands to all evaluators."""
        return f"{self.root}/all/cmd"

    def op_cmd(self) -> str:
        """Return the key of commands from the operator."""
        return f"{self.root}/op/cmd"

    def obs(self, message: Message, evaluator: str = "") -> str:
        """Return the key on which observers hear this message, said by or of one evaluator."""
        tag = str(type(message).__struct_config__.tag)
        return f"{self.root}/obs/{tag}/{evaluator}" if evaluator else f"{self.root}/obs/{tag}"

    def live_evaluator(self, evaluator: str, boot: str) -> str:
        """Return the liveliness key of one life of an evaluator."""
        return f"{self.root}/live/ev/{evaluator}/{boot}"

    def live_learner(self, epoch: int) -> str:
        """Return the liveliness key of one life of the learner."""
        return f"{self.root}/live/learner/{epoch}"

    def from_evaluators(self) -> str:
        """Return the pattern that the learner listens to.

        One for all topics: what comes on one subscription comes in order, while two may overtake
        each other.
        """
        return f"{self.root}/ev/*/*"

    def to_evaluator(self, evaluator: str) -> str:
        """Return the pattern that one evaluator listens to, beside :meth:`all_cmd`."""
        return f"{self.root}/ev/{evaluator}/*"

    def wake(self, evaluator: str = NOBODY) -> str:
        """Return the key on which a process wakes its own waiting thread; it leaves no session.

        The learner's own is that of no evaluator.
        """
        return f"{self.root}/ev/{evaluator}/wake"

    def observed(self) -> str:
        """Return the pattern of everything an observer may hear."""
        return f"{self.root}/obs/**"

    def live_evaluators(self) -> str:
        """Return the liveliness pattern of all evaluators."""
        return f"{self.root}/live/ev/*/*"

    def live_learners(self) -> str:
        """Return the liveliness pattern of this run's learner, whatever its epoch."""
        return f"{self.root}/live/learner/*"


def topic(message: Message, admitted: tuple[str, ...]) -> str:
    """Return the last chunk of the key that carries a message.

    Raises:
        ValueError: If this kind does not travel in that direction.
    """
    tag = str(type(message).__struct_config__.tag)
    said = "cmd" if tag in {"welcome", "refused", "command"} else tag
    if said not in admitted:
        raise ValueError(f"a {tag!r} does not travel on {', '.join(admitted)}")
    return said


def parse(key: str) -> Address:
    """Take a key apart.

    Raises:
        ProtocolError: If it is not a key of this protocol.
    """
    prefix, _, rest = key.partition(f"{ROOT}/")
    chunks = rest.split("/")
    if not prefix and all(map(_CHUNK.fullmatch, chunks)):
        match chunks:
            case [run, "ev", evaluator, said] if said in UP_TOPICS + DOWN_TOPICS:
                return Address(run, said, evaluator)
            case [run, ("all" | "op") as whom, "cmd"]:
                return Address(run, f"{whom}/cmd")
            case [run, "live", "ev", evaluator, boot]:
                return Address(run, "live/ev", evaluator, boot)
            case [run, "live", "learner", epoch] if epoch.isdecimal():
                return Address(run, "live/learner", life=epoch)
            case [run, "obs", tag]:
                return Address(run, f"obs/{tag}")
            case [run, "obs", tag, evaluator]:
                return Address(run, f"obs/{tag}", evaluator)
    raise ProtocolError(f"expected a key under {ROOT}/RUN/, got {key[:200]!r}")
