"""The worker against a real router: how it runs trials, and what it says of them."""

import threading
import time
from collections.abc import Callable

import numpy as np
from evaluator.tiny_learner import BOWL, NAME, WAIT_S, TinyLearner, working

from shearline.evaluator.base import Array, Outcome, Trace, TrialAborted
from shearline.evaluator.builtin import BowlTask
from shearline.evaluator.postman import End
from shearline.evaluator.tasks import FunctionTask
from shearline.evaluator.tasks import task as declare
from shearline.protocol.codec import decode
from shearline.protocol.keys import Address, parse
from shearline.protocol.messages import Bye, Credit, OutcomeKind, Renew, Result, TraceData, Verdict
from shearline.protocol.task import digest


def test_a_worker_runs_a_trial_and_ends_with_the_run(learner: TinyLearner) -> None:
    with working(learner.endpoint) as worker:
        hello = learner.ready()
        assert hello.task_digest == digest(BOWL.spec)
        assert hello.credits in {0, 2}
        learner.give(hello, 7, [1.0, -2.0])
        result = learner.take()
        assert (result.kind, result.trial, result.cost) == (OutcomeKind.SUCCESS, 7, 5.0)
        assert (result.seed, result.engine) == (7, "bowl 1")
        assert 0.001 <= result.wall_s < 1.0
        learner.stop()
        assert learner.next(Bye).boot == hello.boot
        assert worker.end() == End(0, "the run is complete")


def test_no_credit_is_announced_before_the_task_is_warm(learner: TinyLearner) -> None:
    warm = threading.Event()

    class Slow(BowlTask):
        def warm(self) -> None:
            warm.wait(WAIT_S)

    with working(learner.endpoint, Slow(1)):
        hello = learner.welcome()
        assert hello.credits == 0
        assert learner.next(Credit).credits == 0
        warm.set()
        learner.next(Credit, lambda credit: credit.credits == 2)
        learner.stop()


def test_the_liveliness_token_bears_the_boot_and_vanishes_with_the_worker(
    learner: TinyLearner,
) -> None:
    with working(learner.endpoint):
        boot = learner.presence(alive=True)
        assert learner.ready().boot == boot
        learner.stop()
        assert learner.presence(alive=False) == boot


def test_a_result_is_sent_again_until_it_is_acknowledged(learner: TinyLearner) -> None:
    with working(learner.endpoint):
        hello = learner.ready()
        learner.give(hello, 1, [0.0, 0.0])
        first = learner.next(Result)
        assert learner.next(Result) == first
        learner.take()
        learner.stop()
        learner.next(Bye)
        assert len([m for m in learner.heard if isinstance(m, Result)]) == 3


def test_the_same_attempt_twice_is_run_once_and_answered_twice(learner: TinyLearner) -> None:
    with working(learner.endpoint):
        hello = learner.ready()
        trial = learner.give(hello, 1, [3.0, 3.0])
        first = learner.take()
        learner.say(trial)
        assert learner.take() == first
        assert first.kind is OutcomeKind.FAILURE
        learner.stop()


def test_trials_that_wait_are_run_in_order_one_at_a_time(learner: TinyLearner) -> None:
    with working(learner.endpoint, BowlTask(5)):
        learner.spec = BowlTask(5).spec
        hello = learner.ready()
        start_s = time.monotonic()
        for number in range(4):
            learner.give(hello, number, [0.0, 0.0])
        assert [learner.take().trial for _ in range(4)] == [0, 1, 2, 3]
        assert time.monotonic() - start_s >= 4 * 0.005
        learner.stop()


def test_a_tuple_out_of_bounds_is_rejected_and_never_tried(learner: TinyLearner) -> None:
    tried = []

    class Watched(BowlTask):
        def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
            tried.append(theta)
            return super().run(theta, seed, beat)

    with working(learner.endpoint, Watched(1)):
        hello = learner.ready()
        for number, theta in enumerate(([0.0, 5.1], [0.0], [0.0, -1e300])):
            learner.give(hello, number, theta)
            result = learner.take(Verdict.NOTED)
            assert result.kind is OutcomeKind.REJECTED
            assert result.cost == 0.0
            assert result.why
        learner.stop()
    assert not tried


def test_leases_are_renewed_from_the_trials_own_loop(learner: TinyLearner) -> None:
    learner.spec, learner.lease_s = BowlTask(300).spec, 0.4
    with working(learner.endpoint, BowlTask(300)):
        hello = learner.ready()
        trials = [learner.give(hello, number, [0.0, 0.0]) for number in range(2)]
        assert learner.next(Renew).tokens == [trial.token for trial in trials]
        learner.next(Renew)
        assert learner.take().trial == 0
        assert learner.take().trial == 1
        learner.stop()


def test_a_function_is_renewed_for_while_it_runs(learner: TinyLearner) -> None:
    done = threading.Event()

    @declare(space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)}, trial_s=10.0)
    def wait(theta: dict[str, float], rng: np.random.Generator) -> tuple[float, bool]:
        done.wait(WAIT_S)
        return theta["x"], bool(rng.random() < 2.0)

    task = FunctionTask(wait, "lab:wait")
    learner.spec, learner.lease_s = task.spec, 0.2
    with working(learner.endpoint, task):
        hello = learner.ready()
        assert hello.kind == "function"
        trial = learner.give(hello, 1, [2.0, 0.0])
        assert learner.next(Renew).tokens == [trial.token]
        learner.next(Renew)
        done.set()
        assert learner.take().cost == 2.0
        learner.stop()


def test_a_function_that_hangs_is_reported_and_its_process_ended(learner: TinyLearner) -> None:
    done = threading.Event()

    @declare(space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)})
    def hang(theta: dict[str, float], rng: np.random.Generator) -> tuple[float, bool]:
        done.wait(WAIT_S)
        return theta["x"], bool(rng)

    task = FunctionTask(hang, "lab:hang")
    learner.spec, learner.lease_s = task.spec, 0.2
    with working(learner.endpoint, task) as worker:
        hello = learner.ready()
        learner.give(hello, 1, [2.0, 0.0], deadline_s=0.1)
        result = learner.take(Verdict.NOTED)
        assert (result.kind, result.why) == (OutcomeKind.ABORTED, "ran longer than 0.1 s")
        assert learner.next(Bye).why.startswith("trial 1 ran longer")
        assert worker.exits.get(timeout=WAIT_S) == 4
        done.set()
        assert worker.end().code == 4


def test_a_trial_that_beats_is_stopped_at_its_deadline_and_the_worker_goes_on(
    learner: TinyLearner,
) -> None:
    learner.spec = BowlTask(60_000).spec
    with working(learner.endpoint, BowlTask(60_000)) as worker:
        hello = learner.ready()
        for number in range(2):
            learner.give(hello, number, [2.0, 0.0], deadline_s=0.05)
            result = learner.take(Verdict.NOTED)
            assert (result.kind, result.trial) == (OutcomeKind.ABORTED, number)
            assert "longer" in result.why
        learner.stop()
        assert worker.end().code == 0


def test_what_goes_wrong_in_a_trial_is_an_abort_with_its_reason(learner: TinyLearner) -> None:
    class Broken(BowlTask):
        def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
            beat()
            if seed == 0:
                raise TrialAborted("gripper lost the key")
            if seed == 1:
                raise ZeroDivisionError("one over nothing")
            return Outcome(cost=float("nan"), success=bool(theta[0]))

    with working(learner.endpoint, Broken(1)):
        hello = learner.ready()
        for seed, why in enumerate(("gripper lost", "ZeroDivisionError: one", "finite cost")):
            learner.give(hello, seed, [2.0, 0.0])
            result = learner.take(Verdict.NOTED)
            assert result.kind is OutcomeKind.ABORTED
            assert why in result.why
        learner.stop()


def test_a_trace_is_offered_to_observers(learner: TinyLearner) -> None:
    class Traced(BowlTask):
        def run(self, theta: Array, seed: int, beat: Callable[[], None]) -> Outcome:
            beat()
            x = np.full(3, theta[0] + seed, dtype=np.float32)
            t_s = np.arange(3, dtype=np.float32)
            trace = Trace(t_s, {"tip.x": ("m", x)}, ((1.0, "contact"),))
            return Outcome(cost=1.0, success=True, trace=trace)

    with working(learner.endpoint, Traced(1)):
        hello = learner.ready()
        trial = learner.give(hello, 1, [2.0, 0.0])
        learner.take()
        arrival = learner.traces.get(timeout=WAIT_S)
        assert parse(arrival.key) == Address("run-1", "obs/trace", NAME)
        trace = decode(arrival.payload, TraceData)
        assert (trace.trial, trace.token) == (1, trial.token)
        assert (trace.names, trace.units) == (["t_s", "tip.x"], ["s", "m"])
        columns = np.frombuffer(trace.data, "<f4").reshape(2, trace.samples)
        assert columns.tolist() == [[0.0, 1.0, 2.0], [3.0, 3.0, 3.0]]
        assert trace.events == [(1.0, "contact")]
        learner.stop()
