"""Reads a run folder back: trials, episodes, traces, whatever the state of its files.

Every part is read up to its damage; a damaged chunk is left out; each damage is one sentence in
``Run.damage``. Small messages are held in memory, traces are fetched when asked for. Nothing here
draws or judges.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from shearline.protocol.errors import RecordError
from shearline.protocol.messages import (
    Counted,
    EpisodeClosed,
    EvaluatorState,
    Message,
    OutcomeKind,
    Proposed,
    Snapshot,
    Status,
    TraceData,
)
from shearline.protocol.pose import Placed
from shearline.protocol.scene import SceneData
from shearline.record.frames import Frame, chunks_in, frame_at, frames, records_of
from shearline.record.parts import is_live, parts
from shearline.record.phases import Phase, phases_of
from shearline.record.schemas import Decoder
from shearline.record.table import Table, table_of
from shearline.record.topics import TOPICS, RunConfig

Array = npt.NDArray[np.float32]
_M = TypeVar("_M")

_TRACE = TOPICS[TraceData].name
#: Read when a run is opened; of traces only the place is kept.
_HELD = frozenset(
    TOPICS[kind].name
    for kind in (
        RunConfig,
        Proposed,
        Counted,
        EpisodeClosed,
        EvaluatorState,
        SceneData,
        Snapshot,
        Status,
        TraceData,
    )
)


@dataclass(frozen=True, slots=True)
class Trace:
    """What happened during one traced attempt.

    Attributes:
        trial: Number of the trial.
        token: The attempt's.
        t_s: The trial's clock ``(samples,)`` [s].
        columns: Name to ``(unit, values (samples,))``, without the clock.
        events: ``(t_s, name)`` of phase changes, in order.
        placed: Bodies of the scene whose place is this trial's own.
    """

    trial: int
    token: str
    t_s: Array
    columns: dict[str, tuple[str, Array]]
    events: tuple[tuple[float, str], ...]
    placed: tuple[Placed, ...] = ()

    def __getitem__(self, name: str) -> Array:
        """Return the values ``(samples,)`` of one column, the clock as ``"t_s"``."""
        return self.t_s if name == "t_s" else self.columns[name][1]

    def unit(self, name: str) -> str:
        """Return the unit of one column."""
        return "s" if name == "t_s" else self.columns[name][0]


@dataclass(slots=True)
class Run:
    """One recorded run.

    Attributes:
        run_dir: Its folder.
        config: Head of the newest part that names parameters, else of the newest part;
            ``None`` where nothing was recorded.
        proposed: Trials that came into being, by number.
        outcomes: One per trial that reached its outcome, in order of trial number.
        episodes: Closed episodes, in order.
        evaluators: Every change of an evaluator's state, in order of time.
        snapshots: The learner's models, in order of episode.
        scene: What trials look like, as last said; ``None`` where nobody said.
        status: The run at its last glance; ``None`` where none was recorded.
        phases: Trial number to the phases of its last traced attempt.
        damage: One sentence for each damage found; empty for a sound record.
    """

    run_dir: Path
    config: RunConfig | None = None
    proposed: dict[int, Proposed] = field(default_factory=dict)
    outcomes: list[Counted] = field(default_factory=list)
    episodes: list[EpisodeClosed] = field(default_factory=list)
    evaluators: list[EvaluatorState] = field(default_factory=list)
    snapshots: list[Snapshot] = field(default_factory=list)
    scene: SceneData | None = None
    status: Status | None = None
    phases: dict[int, tuple[Phase, ...]] = field(default_factory=dict)
    damage: list[str] = field(default_factory=list)
    _traced: dict[int, list[_Place]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the run, ``""`` where nothing was recorded."""
        return self.config.run if self.config else ""

    @property
    def parameters(self) -> list[str]:
        """Parameter names; ``x0, x1, ...`` where the record does not name them."""
        if self.config and self.config.names:
            return self.config.names
        n = max((len(outcome.theta) for outcome in self.outcomes), default=0)
        return [f"x{i}" for i in range(n)]

    def settings(self) -> dict[str, Any]:
        """Return what ``run.toml`` said, parsed."""
        return tomllib.loads(self.config.text) if self.config else {}

    def trials(self) -> Iterator[dict[str, Any]]:
        """Yield one plain row per trial that reached its outcome, in order of trial number.

        Keys: ``trial, episode, theta`` (by name), ``outcome, cost, success, evaluator,
        evaluator_kind, attempts, seed, engine, digest, wall_s, late, why, extras, purpose``. A
        lost trial has no cost.
        """
        for outcome in self.outcomes:
            yield _row(outcome, self.parameters)

    def table(self) -> Table:
        """Return the trials as columns ``(trials,)`` with units, for numpy and data frames."""
        names = self.parameters
        named = self.config is not None and bool(self.config.names)
        units = self.config.units if self.config and named else [""] * len(names)
        return table_of(self.outcomes, names, units)

    def traced(self) -> list[int]:
        """Return the numbers of the trials that have a trace."""
        return sorted(self._traced)

    def traces(self, trial: int) -> list[Trace]:
        """Return the traces of one trial, one per traced attempt, in order of arrival.

        Raises:
            RecordError: If a part can no longer be read where the trace was found.
        """
        return [to_trace(_fetch(place)) for place in self._traced.get(trial, [])]

    def trace(self, trial: int) -> Trace:
        """Return the trace of one trial; of several traced attempts the last one's.

        Raises:
            RecordError: If there is none, or it can no longer be read.
        """
        places = self._traced.get(trial, [])
        if not places:
            have = f"{len(self._traced)} trials have one" if self._traced else "no trial has one"
            raise RecordError(f"trial {trial} has no trace on this record: {have}")
        return to_trace(_fetch(places[-1]))

    def all_traces(self) -> Iterator[Trace]:
        """Yield every trace in order of arrival; far cheaper than asking trial by trial."""
        for _, message in self.messages(_TRACE):
            assert isinstance(message, TraceData)
            yield to_trace(message)

    def messages(self, topic: str) -> Iterator[tuple[int, Message]]:
        """Yield ``(log time in ns, message)`` of one topic, part after part.

        Args:
            topic: One of ours, e.g. ``"/status"`` or ``"/wire"``.

        Raises:
            RecordError: If the topic is not one of ours.
        """
        known = {entry.name for entry in TOPICS.values()}
        if topic not in known:
            raise RecordError(f"no topic {topic!r}: expected one of {', '.join(sorted(known))}")
        for path in parts(self.run_dir):
            for found in _scan(path, frozenset({topic}), []):
                yield found.log_ns, found.message


def open_run(run_dir: Path | str) -> Run:
    """Open a run folder, or one record file in it.

    Raises:
        RecordError: If there is no such folder.
    """
    folder = Path(run_dir)
    if folder.is_file():
        folder = folder.parent
    if not folder.is_dir():
        raise RecordError(f"expected a run folder, found nothing at {folder}: check the path")
    run = Run(folder)
    for path in parts(folder):
        for found in _scan(path, _HELD, run.damage):
            _hold(run, found)
    run.outcomes = _first_by(run.outcomes, lambda outcome: outcome.trial)
    run.episodes = _first_by(run.episodes, lambda episode: episode.episode)
    run.snapshots.sort(key=lambda snapshot: snapshot.episode)
    return run


@dataclass(frozen=True, slots=True)
class _Place:
    """Where one message stands: which chunk of which part, and which message in it."""

    path: Path
    offset: int
    nth: int


@dataclass(frozen=True, slots=True)
class _Found:
    message: Any
    log_ns: int
    place: _Place


def _hold(run: Run, found: _Found) -> None:
    match found.message:
        case RunConfig() as config:
            run.config = _better(run.config, config)
        case Proposed() as proposed:
            run.proposed.setdefault(proposed.trial, proposed)
        case Counted() as outcome:
            run.outcomes.append(outcome)
        case EpisodeClosed() as episode:
            run.episodes.append(episode)
        case EvaluatorState() as evaluator:
            run.evaluators.append(evaluator)
        case SceneData() as scene:
            run.scene = scene
        case Snapshot() as snapshot:
            run.snapshots.append(snapshot)
        case Status() as status:
            run.status = status
        case TraceData() as trace:
            run.phases[trace.trial] = phases_of(trace)
            run._traced.setdefault(trace.trial, []).append(found.place)  # noqa: SLF001 - its builder


def _better(known: RunConfig | None, found: RunConfig) -> RunConfig:
    """Return the newer head, unless only the older one names parameters."""
    return known if known and known.names and not found.names else found


def _scan(path: Path, topics: frozenset[str], damage: list[str]) -> Iterator[_Found]:
    """Yield the messages of some topics in one part, noting damage instead of raising."""
    part = _Part(path, topics)
    chunks = 0
    with path.open("rb") as file:
        try:
            for frame in frames(file):
                if frame.opcode == Opcode.CHUNK:
                    chunks += 1
                    yield from _chunk(part, frame, damage)
                elif frame.opcode == Opcode.STATISTICS and chunks_in(frame) > chunks:
                    damage.append(f"{path.name}: a chunk cannot be found; all else was read")
        except RecordError as error:
            if not is_live(path):
                damage.append(f"{path.name}: {error}; all else before that was read")


def _chunk(part: _Part, frame: Frame, damage: list[str]) -> Iterator[_Found]:
    try:
        yield from part.messages(frame)
    except RecordError as error:
        damage.append(f"{part.path.name}: {error}; it was left out")


class _Part:
    """Decoders of one part, learnt from its own schemas as they come by."""

    def __init__(self, path: Path, topics: frozenset[str]) -> None:
        self.path = path
        self._topics = topics
        self._schemas: dict[int, Schema] = {}
        self._decoders: dict[int, Decoder] = {}

    def messages(self, frame: Frame) -> Iterator[_Found]:
        for nth, record in enumerate(records_of(frame)):
            if isinstance(record, Schema):
                self._schemas[record.id] = record
            elif isinstance(record, Channel):
                self._learn(record)
            elif (decoder := self._decoders.get(record.channel_id)) is not None:
                place = _Place(self.path, frame.offset, nth)
                yield _Found(decoder(record.data), record.log_time, place)

    def _learn(self, channel: Channel) -> None:
        if channel.topic in self._topics:
            schema = self._schemas[channel.schema_id]
            self._decoders[channel.id] = Decoder(schema.name, schema.data)


def _fetch(place: _Place) -> TraceData:
    """Read one trace again, with the decoders at the head of its part."""
    part = _Part(place.path, frozenset({_TRACE}))
    with place.path.open("rb") as file:
        head = next(frame for frame in frames(file) if frame.opcode == Opcode.CHUNK)
        if head.offset != place.offset:
            for _ in part.messages(head):
                pass
            head = frame_at(file, place.offset)
        for found in part.messages(head):
            if found.place == place:
                trace: TraceData = found.message
                return trace
    raise RecordError(f"{place.path.name} has changed while it was read: open the run again")


def to_trace(trace: TraceData) -> Trace:
    """Give the columns of a trace, which fit together, their shape and names."""
    values = np.frombuffer(trace.data, dtype="<f4").reshape(len(trace.names), trace.samples)
    named = zip(trace.names, trace.units, values, strict=True)
    return Trace(
        trial=trace.trial,
        token=trace.token,
        t_s=values[0],
        columns={name: (unit, column) for name, unit, column in list(named)[1:]},
        events=tuple(trace.events),
        placed=tuple(trace.placed),
    )


def _row(outcome: Counted, names: list[str]) -> dict[str, Any]:
    return {
        "trial": outcome.trial,
        "episode": outcome.episode,
        "theta": dict(zip(names, outcome.theta, strict=False)),
        "outcome": outcome.kind.value if outcome.kind else "lost",
        "cost": outcome.cost if outcome.kind else None,
        "success": outcome.kind is OutcomeKind.SUCCESS,
        "evaluator": outcome.evaluator,
        "evaluator_kind": outcome.evaluator_kind,
        "attempts": outcome.attempts,
        "seed": outcome.seed,
        "engine": outcome.engine,
        "digest": outcome.digest,
        "wall_s": outcome.wall_s,
        "late": outcome.late,
        "why": outcome.why,
        "extras": outcome.extras,
        "purpose": outcome.purpose.value,
    }


def _first_by(messages: list[_M], number: Callable[[_M], int]) -> list[_M]:
    """Keep the first message of each number, in order of number."""
    first: dict[int, _M] = {}
    for message in messages:
        first.setdefault(number(message), message)
    return [first[n] for n in sorted(first)]
