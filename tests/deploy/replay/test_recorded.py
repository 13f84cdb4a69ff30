"""From a run folder to cases: whose traces count, and what is not tried at all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from shearline.deploy.replay.recorded import Recorded
from shearline.evaluator.base import Trace
from shearline.evaluator.local import trace_data
from shearline.protocol.codec import encode
from shearline.protocol.messages import OutcomeKind, Proposed, Result, Wire
from shearline.record.head import config_of
from shearline.record.reader import open_run
from shearline.record.writer import RecordWriter

ENGINE = "functions 1"
LATER_NS = 1_800_000_000_000_000_000


@pytest.fixture
def run_dir(record: Callable[..., Path], tmp_path: Path) -> Path:
    """Have trial 0 tried three times: on its own engine, on another, by who never answered."""
    run_dir = record(tmp_path / "run", "sphere")
    attempts = {"token-ours": ENGINE, "token-other": "functions 2", "token-silent": None}
    with RecordWriter(run_dir, config_of("small", run_dir)) as writer:
        for at, (token, engine) in enumerate(attempts.items()):
            t_s = np.arange(3, dtype=np.float32) + at
            columns = {"x": ("m", t_s)}
            writer.write(trace_data(Trace(t_s, columns), 0, token), log_ns=LATER_NS + at)
            if engine is not None:
                wire = Wire(sent=False, key="ev/a/result", payload=_result(token, engine), at_s=1.0)
                writer.write(wire, log_ns=LATER_NS + at)
        for payload in (b"nonsense", b""):
            writer.write(
                Wire(sent=False, key="ev/a/result", payload=payload, at_s=1.0), log_ns=LATER_NS + 9
            )
        proposed = Proposed(trial=9, episode=1, theta=[1.0] * 20, seed=3)
        writer.write(proposed, log_ns=LATER_NS + 10)
    return run_dir


def _result(token: str, engine: str) -> bytes:
    return encode(
        Result(
            boot="boot-0001",
            token=token,
            trial=0,
            kind=OutcomeKind.SUCCESS,
            cost=1.0,
            seed=1000,
            engine=engine,
        )
    )


def test_a_trace_of_an_attempt_on_another_engine_is_left_out(run_dir: Path) -> None:
    case = Recorded(open_run(run_dir)).case(0)
    assert [float(trace.t_s[0]) for trace in case.traces] == [0.0, 2.0]


def test_a_trial_that_never_ended_is_a_case_of_what_was_proposed(run_dir: Path) -> None:
    recorded = Recorded(open_run(run_dir))
    case = recorded.case(9)
    assert (case.ended, case.theta, case.seed) == (False, (1.0,) * 20, 3)
    assert dict(recorded.unverifiable()) == {4: "lost", 9: "never ended"}
    assert [case.trial for case in recorded.cases()] == [0, 1, 2, 3]
