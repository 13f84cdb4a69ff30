"""Every message that crosses the wire, as frozen typed values.

A message is a msgpack map whose ``"type"`` names it, so that any msgpack library reads it.
Identity is never a field: who sent a message is the evaluator chunk of the key it came on.
Fields are only ever added, with a default; a change of meaning raises ``VERSION``.
"""

from __future__ import annotations

import enum
from typing import Annotated

import msgspec
from msgspec import Meta

from shearline.protocol.pose import Placed
from shearline.protocol.task import TaskSpec

#: Spoken by both sides; a hello with another number is refused.
VERSION = 1

#: Longest sentence a message carries.
TEXT_CHARS_MAX = 2048

# Names and boots stand in keys, so they are plain; `$` alone would admit a final line feed.
Name = Annotated[
    str, Meta(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$(?!\n)")
]
Boot = Annotated[str, Meta(min_length=8, max_length=64, pattern=r"^[A-Za-z0-9_-]*$(?!\n)")]
# What is only ever compared with one that was said before. To match a pattern would take two thirds
# of the time of decoding a trial.
Token = Annotated[str, Meta(min_length=8, max_length=64)]
Text = Annotated[str, Meta(max_length=TEXT_CHARS_MAX)]
Count = Annotated[int, Meta(ge=0, le=2**62)]
Seed = Annotated[int, Meta(ge=0, le=2**63 - 1)]
Seconds = Annotated[float, Meta(ge=0.0)]
Tuple = Annotated[list[float], Meta(min_length=1, max_length=1024)]


class OutcomeKind(enum.StrEnum):
    """What an attempt ended as."""

    SUCCESS = "success"
    FAILURE = "failure"
    ABORTED = "aborted"  # robot, operator or engine fault: never a cost
    REJECTED = "rejected"  # out of the evaluator's own bounds: never a cost


#: Kinds that say something about the tuple: they have a cost.
JUDGED = frozenset({OutcomeKind.SUCCESS, OutcomeKind.FAILURE})


class Verdict(enum.StrEnum):
    """What the learner did with a result."""

    COUNTED = "counted"
    LATE = "late"  # its episode had closed: kept, told with the next update
    DUPLICATE = "duplicate"
    UNKNOWN = "unknown"  # no such attempt was given to this evaluator
    NOTED = "noted"  # aborted or rejected: on record, the trial is given out again


#: Verdicts on a result that became its trial's outcome.
DECIDING = frozenset({Verdict.COUNTED, Verdict.LATE})


class CommandKind(enum.StrEnum):
    """What an operator, through the learner, asks of evaluators."""

    HOLD = "hold"  # finish what runs, take nothing new
    RESUME = "resume"
    STOP = "stop"  # finish or abort what runs, then the run ends


class Purpose(enum.StrEnum):
    """What the trials of an episode are for; the learner hears of the first kind alone."""

    LEARNING = "learning"
    CONFIRMATION = "confirmation"  # the recommended tuple, again and again
    REGION = "region"  # tuples drawn from the recommended region


class Message(msgspec.Struct, frozen=True, kw_only=True, tag_field="type", omit_defaults=False):
    """Base of all messages."""


# -- evaluator to learner ---------------------------------------------------------------------


class Hello(Message, frozen=True, kw_only=True, tag="hello"):
    """An evaluator introduces one boot of itself; repeated until welcomed or refused.

    Attributes:
        boot: Random for each process start; separates two lives of one name.
        version: Protocol version spoken.
        task_digest: :func:`digest` of the task it would run; ``""`` if it takes the learner's.
        kind: ``"simulator"``, ``"function"`` or ``"robot"``.
        engine: Fingerprint of what runs its trials.
        credits: Attempts it will hold at once, running and prefetched together.
        slots: Trials it runs at once.
    """

    boot: Boot
    version: Count
    task_digest: Annotated[str, Meta(max_length=64)]
    kind: Annotated[str, Meta(max_length=32)]
    engine: Text
    credits: Annotated[int, Meta(ge=0, le=1024)]
    slots: Annotated[int, Meta(ge=1, le=1024)] = 1


class Credit(Message, frozen=True, kw_only=True, tag="credit"):
    """An evaluator changes how many attempts it will hold at once (0: hand me nothing new).

    Also its heartbeat while idle. ``seq`` grows by one each time, so that an old credit that
    arrives late is ignored.
    """

    boot: Token
    seq: Count
    credits: Annotated[int, Meta(ge=0, le=1024)]


class Renew(Message, frozen=True, kw_only=True, tag="renew"):
    """The trial's own loop is alive: renews the leases of all tokens named."""

    boot: Token
    tokens: Annotated[list[Token], Meta(max_length=1024)]


class Result(Message, frozen=True, kw_only=True, tag="result"):
    """How an attempt ended; sent again until acknowledged.

    Attributes:
        token: The attempt's.
        trial: The trial's number, for people; the token decides.
        kind: What it ended as.
        cost: In the task's unit; 0 unless success or failure.
        seed: Seed it ran with.
        engine: Fingerprint of what ran it.
        digest: Digest of its trace, or ``""``.
        wall_s: How long it ran [s].
        why: Failure name or abort message.
        extras: Further numbers worth keeping.
    """

    boot: Token
    token: Token
    trial: Count
    kind: OutcomeKind
    cost: float
    seed: Seed
    engine: Text = ""
    digest: Annotated[str, Meta(max_length=128)] = ""
    wall_s: Seconds = 0.0
    why: Text = ""
    extras: Annotated[dict[str, float], Meta(max_length=64)] = {}


class Bye(Message, frozen=True, kw_only=True, tag="bye"):
    """An evaluator leaves on purpose; what it holds may be given out again at once."""

    boot: Token
    why: Text = ""


# -- learner to evaluator ---------------------------------------------------------------------


class Welcome(Message, frozen=True, kw_only=True, tag="welcome"):
    """The learner accepts a boot and says the rules of the run."""

    boot: Token
    epoch: Count
    task: TaskSpec
    lease_s: Annotated[float, Meta(gt=0.0, le=3600.0)]
    held: bool = False


class Refused(Message, frozen=True, kw_only=True, tag="refused"):
    """The learner refuses a boot and says why.

    ``ended`` means that the run is over: nothing was wrong with the evaluator.
    """

    boot: Token
    why: Text
    ended: bool = False


class Trial(Message, frozen=True, kw_only=True, tag="trial"):
    """One attempt, handed to one evaluator.

    Attributes:
        theta: The tuple, in task units.
        lease_s: It is given to another unless renewed within this time [s].
        deadline_s: It counts as hung when it runs longer [s].
        counted: Tokens of results of this boot that were counted: the :class:`Ack` of each, without
            a message of its own.
    """

    boot: Token
    epoch: Count
    trial: Count
    episode: Count
    attempt: Annotated[int, Meta(ge=1, le=1024)]
    token: Token
    theta: Tuple
    seed: Seed
    lease_s: Seconds
    deadline_s: Seconds
    counted: Annotated[list[Token], Meta(max_length=1024)] = []


class Ack(Message, frozen=True, kw_only=True, tag="ack"):
    """The learner has this result in its journal (or never wants it): stop sending it."""

    boot: Token
    token: Token
    verdict: Verdict


class Command(Message, frozen=True, kw_only=True, tag="command"):
    """From the operator to the learner, and from the learner to evaluators."""

    kind: CommandKind
    why: Text = ""


# -- to observers: dropped rather than ever slowing anyone --------------------------------------


class Proposed(Message, frozen=True, kw_only=True, tag="proposed"):
    """A trial came into being."""

    trial: Count
    episode: Count
    theta: Tuple
    seed: Seed
    purpose: Purpose = Purpose.LEARNING


class Counted(Message, frozen=True, kw_only=True, tag="counted"):
    """A trial reached its one outcome (or was lost: ``kind`` is then ``None``).

    ``evaluator_kind`` is what its evaluator said it is, ``""`` in runs of earlier versions. Times
    are the learner's clock [s since the epoch].
    """

    trial: Count
    episode: Count
    theta: Tuple
    kind: OutcomeKind | None
    cost: float
    seed: Seed
    evaluator: Annotated[str, Meta(max_length=64)]
    attempts: Count
    late: bool
    engine: Text
    digest: Annotated[str, Meta(max_length=128)]
    wall_s: Seconds
    why: Text
    extras: Annotated[dict[str, float], Meta(max_length=64)]
    at_s: Seconds
    purpose: Purpose = Purpose.LEARNING
    evaluator_kind: Annotated[str, Meta(max_length=32)] = ""


# Journals hold this one as well: what has its default is left out, so that they stay as they were.
class EpisodeClosed(Message, frozen=True, kw_only=True, tag="episode", omit_defaults=True):
    """An episode is complete.

    ``mean_cost`` is over all its counted trials, ``best_cost`` over its successes.
    """

    episode: Count
    trials: Count
    successes: Count
    success_rate: float
    mean_cost: float | None
    best_cost: float | None
    at_s: Seconds
    purpose: Purpose = Purpose.LEARNING


class EvaluatorState(Message, frozen=True, kw_only=True, tag="evaluator"):
    """Where one evaluator stands, said at every change.

    Attributes:
        state: ``"busy"``, ``"idle"``, ``"resting"``, ``"silent"``, ``"gone"`` or ``"left"``.
        running: How many attempts it holds, those that wait there among them.
        trials: The first of these trials, oldest first.
        lease_s: When the first of their leases runs out unless renewed, from now [s].
    """

    evaluator: Name
    state: Annotated[str, Meta(max_length=32)]
    kind: Annotated[str, Meta(max_length=32)] = ""
    engine: Text = ""
    running: Count = 0
    done: Count = 0
    lost: Count = 0
    at_s: Seconds = 0.0
    trials: Annotated[list[Count], Meta(max_length=16)] = []
    lease_s: Seconds | None = None


class Snapshot(Message, frozen=True, kw_only=True, tag="snapshot"):
    """The learner's model after an episode: JSON text, enough to draw it."""

    episode: Count
    learner: Text
    model: Annotated[str, Meta(max_length=4_000_000)]
    at_s: Seconds


class Status(Message, frozen=True, kw_only=True, tag="status"):
    """The run at a glance, said twice a second and at every change of episode.

    Attributes:
        state: ``"running"``, ``"held"``, ``"stopping"`` or ``"ended"``.
        step_ms_max: Longest step of the learner's owner thread so far, by the wall [ms].
        step_ms_p99: What 99 % of its steps stayed within [ms].
        step_cpu_ms_max: Longest step so far, by its thread's processor time [ms].
        step_cpu_ms_p99: What 99 % of its steps stayed within [ms].
        malformed: Messages that the protocol does not allow, heard in this epoch.
        dropped: Messages that found the inbox crowded, in this epoch.
        confirming: Trials that follow the last episode to confirm what was recommended.
    """

    run: Text
    task: Text
    learner: Text
    epoch: Count
    state: Annotated[str, Meta(max_length=32)]
    episode: Count
    episodes: Count
    trials_per_episode: Count
    pending: Count
    leased: Count
    done: Count
    counted: Count
    lost: Count
    late: Count
    duplicates: Count
    aborted: Count
    rejected: Count
    rate_hz: float
    step_ms_max: float
    evaluators: list[EvaluatorState]
    history: list[EpisodeClosed]
    at_s: Seconds
    step_ms_p99: float = 0.0
    step_cpu_ms_max: float = 0.0
    step_cpu_ms_p99: float = 0.0
    malformed: Count = 0
    dropped: Count = 0
    confirming: Count = 0


class TraceData(Message, frozen=True, kw_only=True, tag="trace"):
    """One trial's trace: columns of little-endian float32 that share one trial clock.

    Attributes:
        names: Column names; the first is ``t_s``.
        units: One for each column.
        data: ``samples * len(names)`` float32, column after column.
        events: ``(t_s, name)`` of phase changes.
        placed: Bodies whose place is this trial's own.
    """

    trial: Count
    token: Token
    samples: Annotated[int, Meta(ge=0, le=1_000_000)]
    names: Annotated[list[str], Meta(max_length=256)]
    units: Annotated[list[str], Meta(max_length=256)]
    data: bytes
    events: Annotated[list[tuple[float, str]], Meta(max_length=256)] = []
    placed: Annotated[list[Placed], Meta(max_length=256)] = []

    def __post_init__(self) -> None:
        """Refuse columns that do not fit together (msgspec turns this into its own error)."""
        size = 4 * self.samples * len(self.names)
        if len(self.units) != len(self.names) or len(self.data) != size:
            raise ValueError(
                f"expected a unit for each of {len(self.names)} names and {size} bytes,"
                f" got {len(self.units)} units and {len(self.data)} bytes"
            )


class Wire(Message, frozen=True, kw_only=True, tag="wire"):
    """One protocol message as the learner saw or sent it, for the record."""

    sent: bool
    key: Text
    payload: bytes
    at_s: Seconds


def clip(text: str, chars: int = TEXT_CHARS_MAX) -> str:
    """Return text that any message may carry: no lone surrogates, not too long."""
    return text[:chars] if text.isascii() else text.encode("utf-8", "replace").decode()[:chars]
