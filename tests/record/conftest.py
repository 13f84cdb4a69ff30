"""A small run as observers hear it, made of real messages with the shapes of a key-lock run."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

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
    Wire,
)
from shearline.record.head import config_of
from shearline.record.writer import RecordWriter

SPACE = {
    "ins_push": ("N", 0.0, 20.0),
    "ins_speed": ("m/s", 0.002, 0.1),
    "wig_a_x": ("N", 0.0, 10.0),
    "wig_f_x": ("Hz", 0.0, 3.0),
    "ins_k_rot": ("N m/rad", 5.0, 200.0),
}
JOINTS = 7
TORQUE_LIMITS_NM = np.array([40.0] * 4 + [12.0] * 3)


def run_toml(space: dict[str, tuple[str, float, float]] | None = None) -> str:
    rows = [
        f'{name} = ["{unit}", {low!r}, {high!r}]'
        for name, (unit, low, high) in (SPACE if space is None else space).items()
    ]
    head = ['run = "synthetic"', "seed = 0", "[task]", 'name = "keylock"', "[task.space]"]
    return "\n".join([*head, *rows]) + "\n"


def trace(trial: int, theta: list[float], *, hz: float = 1000.0, success: bool = True) -> TraceData:
    """An insertion: approach, contact, then sinking with a wiggle; failures stay half way."""
    rng = np.random.default_rng(trial)
    end_s = (0.6 + 6.0 / (2.0 + theta[0])) if success else 5.0
    t_s = np.arange(0.0, end_s, 1.0 / hz)
    sink = np.clip((t_s - 0.3) / (end_s - 0.3), 0.0, 1.0)
    depth = sink * (0.025 if success else 0.011)
    wiggle = theta[2] * np.sin(2 * np.pi * theta[3] * t_s) * (t_s > 0.3)
    columns: dict[str, tuple[str, np.ndarray]] = {
        "tip.x": ("m", 0.5 + 2e-4 * np.sin(9 * t_s) + 1e-5 * rng.standard_normal(t_s.size)),
        "tip.y": ("m", 2e-4 * np.cos(7 * t_s)),
        "tip.z": ("m", 0.31 - depth + 0.02 * np.clip(0.3 - t_s, 0, 1)),
        "depth": ("m", depth),
        "push": ("N", theta[0] * (t_s > 0.3)),
        "wiggle.x": ("N", wiggle),
        "wiggle.y": ("N", 0.5 * wiggle),
        "wrench.fx": ("N", 0.3 * wiggle + rng.standard_normal(t_s.size) * 0.2),
        "wrench.fy": ("N", 0.1 * wiggle + rng.standard_normal(t_s.size) * 0.2),
        "wrench.fz": ("N", 0.8 * theta[0] * (t_s > 0.3) + rng.standard_normal(t_s.size) * 0.3),
        "phase": ("", np.where(t_s < 0.3, 1.0, 2.0)),
    }
    for j in range(JOINTS):
        columns[f"q.{j + 1}"] = ("rad", 0.1 * j + 0.01 * np.sin(t_s))
        columns[f"tau_ext.{j + 1}"] = ("N m", 0.2 * (j + 1) * np.sin(5 * t_s + j))
    data = np.stack([t_s, *(values for _, values in columns.values())]).astype("<f4")
    return TraceData(
        trial=trial,
        token=f"token-{trial:08d}",
        samples=t_s.size,
        names=["t_s", *columns],
        units=["s", *(unit for unit, _ in columns.values())],
        data=data.tobytes(),
        events=[(0.0, "contact"), (0.3, "insertion"), (end_s, "success" if success else "time")],
    )


def status(at_s: float, state: str = "running", *, counted: int = 0) -> Status:
    return Status(
        run="synthetic",
        task="keylock",
        learner="psp",
        epoch=1,
        state=state,
        episode=0,
        episodes=2,
        trials_per_episode=4,
        pending=0,
        leased=0,
        done=0,
        counted=counted,
        lost=0,
        late=0,
        duplicates=0,
        aborted=0,
        rejected=0,
        rate_hz=1.0,
        step_ms_max=0.4,
        evaluators=[],
        history=[],
        at_s=at_s,
    )


def counted(trial: int, episode: int, theta: list[float], kind: OutcomeKind | None) -> Counted:
    success = kind is OutcomeKind.SUCCESS
    cost = 0.0 if kind is None else (4.0 / (2.0 + theta[0]) if success else 10.6)
    return Counted(
        trial=trial,
        episode=episode,
        theta=theta,
        kind=kind,
        cost=cost,
        seed=1000 + trial,
        evaluator=f"sim-{trial % 2}",
        attempts=3 if kind is None else 1,
        late=False,
        engine="mujoco 4.0.0 model 3f2a",
        digest=f"{trial:064x}",
        wall_s=0.2,
        why="" if success else "time",
        extras={"depth_m": 0.025 if success else 0.011},
        at_s=1_700_000_000.0 + trial,
    )


def stream(episodes: int = 2, per_episode: int = 4, *, hz: float = 200.0) -> Iterator[Message]:
    """Everything observers hear of one run, in order; its last word is ``ended``."""
    rng = np.random.default_rng(7)
    low = np.array([low for _, low, _ in SPACE.values()])
    high = np.array([high for _, _, high in SPACE.values()])
    start_s = 1_700_000_000.0
    for name in ("sim-0", "sim-1"):
        yield EvaluatorState(evaluator=name, state="idle", kind="simulator", at_s=start_s)
    for episode in range(episodes):
        kinds = []
        for trial in range(episode * per_episode, (episode + 1) * per_episode):
            centre = min(0.9, 0.4 + 0.06 * episode)
            u = np.clip(centre + rng.normal(0, 0.35 / (1 + 0.5 * episode), low.size), 0, 1)
            theta = (low + u * (high - low)).tolist()
            success = theta[0] > 8.0
            kind = OutcomeKind.SUCCESS if success else OutcomeKind.FAILURE
            kinds.append(kind)
            yield Proposed(trial=trial, episode=episode, theta=theta, seed=1000 + trial)
            yield Wire(sent=True, key="ev/sim-0/trial", payload=b"\x80", at_s=start_s + trial)
            yield trace(trial, theta, hz=hz, success=success)
            yield counted(trial, episode, theta, kind)
        wins = sum(kind is OutcomeKind.SUCCESS for kind in kinds)
        yield EpisodeClosed(
            episode=episode,
            trials=per_episode,
            successes=wins,
            success_rate=wins / per_episode,
            mean_cost=5.0 - episode * 0.4,
            best_cost=0.4 if wins else None,
            at_s=start_s + (episode + 1) * per_episode,
        )
        yield Snapshot(
            episode=episode, learner="psp", model='{"means": [[0.5]]}', at_s=start_s + episode
        )
        yield status(start_s + (episode + 1) * per_episode, counted=per_episode * (episode + 1))
    yield status(time.time(), "ended", counted=episodes * per_episode)


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    (tmp_path / "run.toml").write_text(run_toml(), encoding="utf-8")
    return tmp_path


@pytest.fixture
def write_run(run_dir: Path) -> Callable[..., Path]:
    """Write a whole synthetic run into the run folder, as the recorder would."""

    def write(**shape: int) -> Path:
        now_ns = time.time_ns()
        with RecordWriter(run_dir, config_of("synthetic", run_dir)) as writer:
            for message in stream(**shape):
                now_ns += 50_000_000
                writer.write(message, log_ns=now_ns)
                writer.tick(now_ns)
        return run_dir

    return write


@pytest.fixture
def messages() -> Callable[..., list[Message]]:
    def make(**shape: int) -> list[Message]:
        return list(stream(**shape))

    return make
