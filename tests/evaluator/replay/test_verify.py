"""A recorded trial comes out again to the last bit; anything that was changed is caught."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from shearline.evaluator.base import Array, Outcome, Task, Trace, TrialAborted
from shearline.evaluator.builtin import BenchmarkTask, BowlTask
from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.replay import Case, Change, Verification, again, verify
from shearline.protocol.errors import ConfigError
from shearline.protocol.messages import OutcomeKind

CaseOf = Callable[[Task, list[float], int], Case]


def with_outcome(case: Case, **fields: object) -> Case:
    assert case.outcome is not None
    return replace(case, outcome=msgspec.structs.replace(case.outcome, **fields))


def with_sample(case: Case, channel: str, sample: int) -> Case:
    """Flip the lowest bit of one sample on record."""
    trace = case.traces[0]
    unit, values = trace.columns[channel]
    values = values.copy()
    values.view(np.uint32)[sample] ^= np.uint32(1)
    columns: Mapping[str, tuple[str, np.ndarray]] = {**trace.columns, channel: (unit, values)}
    return replace(case, traces=(replace(trace, columns=columns),))


def refused(task: KeylockTask, case: Case) -> Verification:
    verified = verify(task, case)
    assert not verified.identical
    assert verified.why
    assert "\n" not in verified.why
    return verified


def test_a_recorded_trial_comes_out_again(keylock: KeylockTask, recorded: Case) -> None:
    keylock.run(np.asarray(recorded.theta), 99, lambda: None)  # what ran before must not matter
    verified = verify(keylock, recorded)
    assert verified.identical
    assert verified.digest_recorded == verified.digest_replayed == recorded.digest
    assert not verified.why


def test_without_a_recorded_trace_the_digest_alone_decides(
    keylock: KeylockTask, recorded: Case
) -> None:
    assert verify(keylock, replace(recorded, traces=())).identical
    why = refused(keylock, replace(with_outcome(recorded, digest="0" * 32), traces=())).why
    assert "no trace is on record to say where" in why


@pytest.mark.parametrize(("channel", "sample"), [("depth", -1), ("q.4", 0), ("pin.5", 700)])
def test_one_bit_of_a_recorded_trace_is_caught_and_named(
    keylock: KeylockTask, recorded: Case, channel: str, sample: int
) -> None:
    verified = refused(keylock, with_sample(recorded, channel, sample))
    assert verified.digest_recorded == verified.digest_replayed
    at_s = recorded.traces[0].t_s[sample]
    assert f"{channel} is the first to differ, at {at_s:.4f} s by" in verified.why
    assert "the record was changed" in verified.why


def test_a_changed_trace_of_a_second_attempt_is_caught_too(
    keylock: KeylockTask, recorded: Case
) -> None:
    second = with_sample(recorded, "depth", 3).traces[0]
    why = refused(keylock, replace(recorded, traces=(*recorded.traces, second))).why
    assert "in attempt 2 of 2" in why


def test_a_changed_digest_is_caught(keylock: KeylockTask, recorded: Case) -> None:
    why = refused(keylock, with_outcome(recorded, digest="0" * 32)).why
    assert "no sample on record does" in why


def test_one_digit_of_a_parameter_is_caught_by_what_comes_out(
    keylock: KeylockTask, recorded: Case
) -> None:
    theta = list(recorded.theta)
    at = list(recorded.task.space).index("ins_push")
    theta[at] = math.nextafter(theta[at], 0.0)
    changed = with_outcome(replace(recorded, theta=tuple(theta), proposed=None), theta=theta)
    verified = refused(keylock, changed)
    assert verified.digest_recorded != verified.digest_replayed


def test_a_parameter_the_trial_never_used_is_caught_by_what_was_proposed(
    keylock: KeylockTask, recorded: Case
) -> None:
    theta = list(recorded.theta)
    theta[0] = math.nextafter(theta[0], 1.0)
    why = refused(keylock, with_outcome(recorded, theta=theta)).why
    assert "app_off_x was proposed as" in why
    assert "the record was changed after the run" in why


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"cost": 0.5}, "the cost is 0.5 on record"),
        ({"kind": OutcomeKind.FAILURE, "why": "time"}, "the outcome on record is failure time"),
        ({"extras": {"depth_m": 0.1}}, "depth_m is 0.1 on record"),
    ],
)
def test_a_changed_outcome_is_caught(
    keylock: KeylockTask, recorded: Case, fields: dict[str, object], said: str
) -> None:
    assert said in refused(keylock, with_outcome(recorded, **fields)).why


def test_another_engine_is_named(keylock: KeylockTask, recorded: Case) -> None:
    engine = "mujoco 3.9.0 model 11ec15c7b3af skill 1"
    other = with_sample(with_outcome(recorded, engine=engine), "depth", 5)
    assert f"the engine is not the same: {engine} on record, mujoco 4" in verify(keylock, other).why
    same = verify(keylock, with_outcome(recorded, engine=engine))
    assert same.identical
    assert same.why.startswith("the engine is not the same")


def test_a_case_names_the_plant_it_was_tried_on(recorded: Case) -> None:
    assert recorded.plant == "mujoco"
    assert with_outcome(recorded, engine="pybullet 3.2.7 model 0a skill 1").plant == "pybullet"


def test_another_task_is_named_by_what_differs(recorded: Case) -> None:
    limited = KeylockTask("keylock-limit")
    case = with_sample(recorded, "depth", 5)
    assert "its name was 'keylock', here it is 'keylock-limit'" in verify(limited, case).why
    push = recorded.task.space["ins_push"]
    wider = {**recorded.task.space, "ins_push": ("N", push[1], push[2] + 1.0)}
    case = replace(case, task=msgspec.structs.replace(recorded.task, space=wider))
    assert "ins_push went from 0 to 21 N, here it goes from 0 to 20 N" in verify(limited, case).why


def test_a_task_with_other_parameters_cannot_run_it(recorded: Case) -> None:
    with pytest.raises(ConfigError, match=r"has the parameters app_off_x.*the one here has x, y"):
        verify(BowlTask(0), recorded)


@pytest.mark.parametrize("kind", [None, "no outcome"])
def test_a_trial_that_never_ended_cannot_be_verified(
    keylock: KeylockTask, recorded: Case, kind: str | None
) -> None:
    lost = replace(recorded, outcome=None) if kind else with_outcome(recorded, kind=None)
    with pytest.raises(ConfigError, match="nothing to verify"):
        verify(keylock, lost)
    assert again(keylock, lost).digest == recorded.digest


def test_a_task_without_traces_is_verified_by_its_outcome(case_of: CaseOf) -> None:
    task = BenchmarkTask("rastrigin")
    case = case_of(task, [0.5] * 20, 3)
    verified = verify(task, case)
    assert verified.identical
    assert verified.digest_recorded == verified.digest_replayed != ""
    assert case.outcome is not None
    cost = math.nextafter(case.outcome.cost, 0.0)
    assert "the cost is" in verify(task, with_outcome(case, cost=cost)).why


class Broken(BowlTask):
    """Reaches no verdict any more."""

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
        del theta, seed, beat
        raise TrialAborted("the engine is gone")


def test_a_trial_that_is_aborted_here_is_not_identical(case_of: CaseOf) -> None:
    case = case_of(BowlTask(0), [1.0, 1.0], 3)
    verified = verify(Broken(0), case)
    assert not verified.identical
    assert verified.digest_replayed == ""
    assert "it was success and is aborted here (the engine is gone)" in verified.why


class Tracing(BowlTask):
    """Has a trace where the record has none."""

    def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
        outcome = super().run(theta, seed, beat)
        return replace(outcome, digest="1" * 32, trace=Trace(np.zeros(1, np.float32), {}))


def test_a_trace_that_came_with_a_later_version_changes_nothing(case_of: CaseOf) -> None:
    case = case_of(BowlTask(0), [1.0, 1.0], 3)
    assert verify(Tracing(0), case).identical
    traced = case_of(Tracing(0), [1.0, 1.0], 3)
    assert "the task here has none" in verify(BowlTask(0), traced).why


def test_what_if_runs_the_changed_trial_and_leaves_the_record_alone(
    keylock: KeylockTask, recorded: Case
) -> None:
    replayed = again(keylock, recorded, Change({"ins_push": 0.0}, seed=5))
    assert replayed.verdict.kind is OutcomeKind.FAILURE
    assert replayed.seed == 5
    assert replayed.theta[list(recorded.task.space).index("ins_push")] == 0.0
    assert recorded.seed == 4
    message = replayed.trace_data()
    assert message is not None
    assert message.trial == recorded.trial
    assert message.samples == round(replayed.verdict.extras["trial_s"] / 1e-3)


def test_what_a_task_prints_stays_off_standard_output(
    capsys: pytest.CaptureFixture[str], case_of: CaseOf
) -> None:
    class Chatty(BowlTask):
        def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
            print("hello")  # noqa: T201 - that is the point
            return super().run(theta, seed, beat)

    again(Chatty(0), case_of(BowlTask(0), [1.0, 1.0], 3))
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", "hello\n")
