"""Small runs on record whose trials were really run, and a way to change what is on record."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from shearline.evaluator.base import Task
from shearline.evaluator.local import run_trial, trace_data
from shearline.evaluator.tasks import load_task
from shearline.learner.run.config import RunConfig, to_toml
from shearline.protocol.messages import Counted, EvaluatorState, Message, Proposed
from shearline.protocol.space import Space
from shearline.record import schemas
from shearline.record.head import config_of
from shearline.record.schemas import Decoder
from shearline.record.writer import RecordWriter

START_NS = 1_700_000_000_000_000_000
TRIALS = 4


def _messages(task: Task, evaluator: str) -> Iterable[Message]:
    """Run a few trials and yield what observers would hear of them."""
    rng = np.random.default_rng(1)
    space = Space(task.spec.space)
    for trial in range(TRIALS):
        theta = space.denormalise(rng.uniform(size=len(space))).tolist()
        seed = 1000 + trial
        yield Proposed(trial=trial, episode=0, theta=theta, seed=seed)
        verdict = run_trial(task, theta, seed)
        if verdict.trace is not None:
            yield trace_data(verdict.trace, trial, f"token-{trial:04d}")
        yield Counted(
            trial=trial,
            episode=0,
            theta=theta,
            kind=verdict.kind,
            cost=verdict.cost,
            seed=seed,
            evaluator=evaluator,
            attempts=1,
            late=False,
            engine=task.engine,
            digest=verdict.digest,
            wall_s=verdict.wall_s,
            why=verdict.why,
            extras=dict(verdict.extras),
            at_s=START_NS * 1e-9 + trial,
        )


def _record(run_dir: Path, name: str, *, evaluator: str = "sim-0", kind: str = "") -> Path:
    """Write a run of one episode into a folder, as the recorder would."""
    run_dir.mkdir(parents=True, exist_ok=True)
    task = load_task(name)
    config = RunConfig(task=task.spec, episodes=1, trials=TRIALS)
    (run_dir / "run.toml").write_text(to_toml(config), encoding="utf-8")
    with RecordWriter(run_dir, config_of("small", run_dir)) as writer:
        at_ns = START_NS
        if kind:
            state = EvaluatorState(evaluator=evaluator, state="idle", kind=kind)
            writer.write(state, log_ns=at_ns)
        for message in _messages(task, evaluator):
            at_ns += 250_000_000
            writer.write(message, log_ns=at_ns)
            writer.tick(at_ns)
        lost = Counted(
            trial=TRIALS,
            episode=0,
            theta=Space(task.spec.space).low.tolist(),
            kind=None,
            cost=0.0,
            seed=7,
            evaluator="",
            attempts=3,
            late=False,
            engine="",
            digest="",
            wall_s=0.0,
            why="",
            extras={},
            at_s=START_NS * 1e-9,
        )
        writer.write(lost, log_ns=at_ns + 1)
    return run_dir


@pytest.fixture(scope="session")
def record() -> Callable[..., Path]:
    """Run a few trials of a task and record them."""
    return _record


@pytest.fixture(scope="session")
def keylock_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four trials of the key-in-lock and a lost one; to be read only."""
    return _record(tmp_path_factory.mktemp("keylock"), "keylock")


@pytest.fixture(scope="session")
def sphere_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four trials without traces and a lost one; to be read only."""
    return _record(tmp_path_factory.mktemp("sphere"), "sphere")


@pytest.fixture
def tampered(tmp_path: Path) -> Callable[..., Path]:
    """Copy a run with the messages of one topic as a function changes them; ``None`` drops one."""

    def tamper(run_dir: Path, topic: str, edit: Callable[[Any], Any]) -> Path:
        copy = tmp_path / "copy"
        shutil.copytree(run_dir, copy)
        _rewrite(run_dir / "record.mcap", copy / "record.mcap", topic, edit)
        return copy

    return tamper


def _rewrite(source: Path, target: Path, topic: str, edit: Callable[[Any], Any]) -> None:
    with source.open("rb") as read, target.open("wb") as write:
        writer = Writer(write)
        writer.start()
        known: dict[int, int] = {}
        for schema, channel, message in make_reader(read).iter_messages(log_time_order=False):
            assert schema is not None
            if channel.id not in known:
                declared = writer.register_schema(schema.name, schema.encoding, schema.data)
                known[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, declared, dict(channel.metadata)
                )
            data = message.data
            if channel.topic == topic:
                changed = edit(Decoder(schema.name, schema.data)(data))
                if changed is None:
                    continue
                data = schemas.encode(changed)
            writer.add_message(
                known[channel.id],
                message.log_time,
                data,
                message.publish_time,
                message.sequence,
            )
        writer.finish()


@pytest.fixture(scope="session")
def with_fields() -> Callable[..., Callable[[Any], Any]]:
    """Return an edit that replaces fields in the message of one trial."""

    def edit_of(trial: int, **fields: Any) -> Callable[[Any], Any]:
        def edit(message: Any) -> Any:
            if message.trial != trial:
                return message
            values = {k: v(getattr(message, k)) if callable(v) else v for k, v in fields.items()}
            return msgspec.structs.replace(message, **values)

        return edit

    return edit_of
