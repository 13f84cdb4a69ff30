"""The worker against a real router: a tiny learner in the test's own process hands out trials."""

import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Self, TypeVar

import numpy as np
import pytest

from shearline.evaluator.base import Array, Outcome, Task, Trace, TrialAborted
from shearline.evaluator.builtin import BowlTask
from shearline.evaluator.postman import End
from shearline.evaluator.tasks import FunctionTask
from shearline.evaluator.tasks import task as declare
from shearline.evaluator.worker import Worker, WorkerConfig, default_name, run_worker
from shearline.protocol.codec import BY_TOPIC, decode, encode
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import ConfigError
from shearline.protocol.intake import Presence
from shearline.protocol.keys import Address, Keys, check_name, parse
from shearline.protocol.link import Link, open_router
from shearline.protocol.messages import (
    Ack,
    Bye,
    Command,
    CommandKind,
    Credit,
    Hello,
    Message,
    OutcomeKind,
    Refused,
    Renew,
    Result,
    TaskSpec,
    TraceData,
    Trial,
    Verdict,
    Welcome,
    digest,
)

pytest.importorskip("zenoh")

M = TypeVar("M", bound=Message)
WAIT_S = 5.0
NAME = "lab-1"
BOWL = BowlTask(1)


@dataclass
class TinyLearner:
    """Just enough of a learner to test a worker: it says what the test tells it to say."""

    endpoint: str
    epoch: int = 1
    run: str = "run-1"
    spec: TaskSpec = BOWL.spec
    lease_s: float = 1.0
    heard: list[Message] = field(default_factory=list)

    def __enter__(self) -> Self:
        self.inbox: SimpleQueue[Any] = SimpleQueue()
        self.link: Link = open_router(self.endpoint)
        self.keys = Keys(self.run)
        self.traces: SimpleQueue[Any] = SimpleQueue()
        self.link.subscribe(self.keys.from_evaluators(), self.inbox)
        self.link.subscribe(self.keys.observed(), self.traces)
        self.link.watch(self.keys.live_evaluators(), self.inbox)
        self.link.announce(self.keys.live_learner(self.epoch))
        return self

    def __exit__(self, *_: object) -> None:
        self.link.close()

    def say(self, message: Message) -> None:
        self.link.publish(self.keys.down(NAME, message), encode(message))

    def next(self, kind: type[M], where: Callable[[M], bool] = lambda _: True) -> M:
        """Return the next message of a kind, past whatever comes before it."""
        end_s = time.monotonic() + WAIT_S
        while True:
            item = self.inbox.get(timeout=max(0.01, end_s - time.monotonic()))
            if isinstance(item, Presence):
                continue
            message = decode(item.payload, *BY_TOPIC[parse(item.key).topic])
            self.heard.append(message)
            if isinstance(message, kind) and where(message):
                return message

    def presence(self, *, alive: bool) -> str:
        """Return the boot of the next evaluator that appears or vanishes."""
        while True:
            item = self.inbox.get(timeout=WAIT_S)
            if isinstance(item, Presence) and item.alive is alive:
                return parse(item.key).life

    def welcome(self) -> Hello:
        hello = self.next(Hello)
        self.say(Welcome(boot=hello.boot, epoch=self.epoch, task=self.spec, lease_s=self.lease_s))
        return hello

    def ready(self) -> Hello:
        """Welcome a worker and wait until it has room."""
        hello = self.welcome()
        self.next(Credit, lambda credit: credit.credits > 0)
        return hello

    def give(self, hello: Hello, number: int, theta: list[float], **changes: Any) -> Trial:
        facts: dict[str, Any] = {
            "boot": hello.boot,
            "epoch": self.epoch,
            "trial": number,
            "episode": 0,
            "attempt": 1,
            "token": f"token-{number:06}",
            "theta": theta,
            "seed": number,
            "lease_s": self.lease_s,
            "deadline_s": 10.0,
        }
        trial = Trial(**(facts | changes))
        self.say(trial)
        return trial

    def take(self, verdict: Verdict = Verdict.COUNTED) -> Result:
        result = self.next(Result)
        self.say(Ack(boot=result.boot, token=result.token, verdict=verdict))
        return result

    def stop(self) -> None:
        stop = Command(kind=CommandKind.STOP, why="the run is complete")
        self.link.publish(self.keys.all_cmd(), encode(stop))


@dataclass
class Running:
    """A worker on a thread of this process."""

    ends: SimpleQueue[End] = field(default_factory=SimpleQueue)
    exits: SimpleQueue[int] = field(default_factory=SimpleQueue)

    def end(self) -> End:
        return self.ends.get(timeout=WAIT_S)


@contextmanager
def working(endpoint: str, task: Task | None = BOWL, **changes: Any) -> Iterator[Running]:
    config = WorkerConfig(connect=endpoint, name=NAME, **changes)
    running = Running()
    worker = Worker(config, task, running.exits.put)
    thread = threading.Thread(target=lambda: running.ends.put(worker.run()), daemon=True)
    thread.start()
    try:
        yield running
    except BaseException:
        worker.exchange.leave(130, "the test failed")
        raise
    finally:
        thread.join(WAIT_S)


@pytest.fixture
def learner() -> Iterator[TinyLearner]:
    with TinyLearner(free_endpoint()) as learner:
        yield learner


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


def test_a_worker_without_a_task_takes_the_learners(learner: TinyLearner) -> None:
    with working(learner.endpoint, None) as worker:
        hello = learner.ready()
        assert hello.task_digest == ""
        learner.give(hello, 1, [1.0, 0.0])
        assert learner.take().cost == 1.0
        learner.stop()
        assert worker.end().code == 0


@pytest.mark.parametrize(
    ("spec", "code", "why"),
    [
        (TaskSpec(name="os:system", space={"x": ("", 0.0, 1.0)}), 2, "no built-in"),
        (TaskSpec(name="sleep-1", space={"x": ("", 0.0, 1.0)}), 4, "other bounds"),
    ],
)
def test_a_task_that_cannot_be_taken_from_the_learner_ends_the_worker(
    learner: TinyLearner, spec: TaskSpec, code: int, why: str
) -> None:
    learner.spec = spec
    with working(learner.endpoint, None) as worker:
        learner.welcome()
        end = worker.end()
        assert end.code == code
        assert why in end.why
        learner.next(Bye)


@pytest.mark.parametrize(
    ("fault", "code", "why"),
    [
        (OSError("no engine"), 4, "task sleep-1 cannot start here: OSError: no engine"),
        (ConfigError("no such level"), 2, "no such level"),
        (ModuleNotFoundError(name="mujoco"), 2, "needs mujoco, which is not installed here"),
    ],
)
def test_a_task_that_cannot_be_warmed_ends_the_worker(
    learner: TinyLearner, fault: Exception, code: int, why: str
) -> None:
    class Cold(BowlTask):
        def warm(self) -> None:
            raise fault

    with working(learner.endpoint, Cold(1)) as worker:
        learner.welcome()
        end = worker.end()
        assert end.code == code
        assert why in end.why


def test_a_task_that_never_gets_warm_does_not_keep_the_process(learner: TinyLearner) -> None:
    thawed = threading.Event()

    class Frozen(BowlTask):
        def warm(self) -> None:
            thawed.wait(WAIT_S)

    with working(learner.endpoint, Frozen(1)) as worker:
        learner.welcome()
        learner.stop()
        assert worker.exits.get(timeout=WAIT_S) == 0
        thawed.set()


def test_a_refused_worker_ends_with_the_learners_reason(learner: TinyLearner) -> None:
    with working(learner.endpoint) as worker:
        hello = learner.next(Hello)
        learner.say(Refused(boot="another-boot", why="not you"))
        learner.say(Refused(boot=hello.boot, why="another name, please"))
        assert worker.end() == End(4, "another name, please")


def test_a_worker_that_comes_after_the_end_of_the_run_just_ends(learner: TinyLearner) -> None:
    with working(learner.endpoint) as worker:
        hello = learner.next(Hello)
        learner.say(Refused(boot=hello.boot, why="the run has ended", ended=True))
        assert worker.end() == End(0, "the run has ended")


def test_hostile_bytes_are_ignored(learner: TinyLearner) -> None:
    with working(learner.endpoint):
        hello = learner.ready()
        for topic in ("trial", "ack", "cmd"):
            for payload in (b"", b"\xc1", b"\x91" * 50_000, encode(hello)):
                learner.link.publish(f"{learner.keys.root}/ev/{NAME}/{topic}", payload)
        learner.link.publish(learner.keys.all_cmd(), b"\x80")
        learner.give(hello, 1, [1.0, 0.0])
        assert learner.take().cost == 1.0
        learner.stop()


def test_a_learner_that_starts_again_gets_what_it_missed(learner: TinyLearner) -> None:
    with working(learner.endpoint) as worker:
        hello = learner.ready()
        learner.give(hello, 1, [1.0, 0.0])
        missed = learner.next(Result)
        learner.link.close()
        with TinyLearner(learner.endpoint, epoch=2) as second:
            again = second.welcome()
            assert (again.boot, again.credits) == (hello.boot, 2)
            assert second.take() == missed
            second.give(again, 2, [2.0, 0.0])
            assert second.take().cost == 4.0
            second.stop()
            assert worker.end().code == 0


def test_the_trial_goes_on_while_the_learner_is_away(learner: TinyLearner) -> None:
    learner.spec = BowlTask(300).spec
    with working(learner.endpoint, BowlTask(300)):
        hello = learner.ready()
        learner.give(hello, 1, [1.0, 0.0])
        learner.next(Renew)
        learner.link.close()
        with TinyLearner(learner.endpoint, epoch=2, spec=learner.spec) as second:
            second.welcome()
            result = second.take()
            assert (result.kind, result.cost) == (OutcomeKind.SUCCESS, 1.0)
            second.stop()


def test_a_worker_ends_when_another_run_takes_the_place_of_its_own(learner: TinyLearner) -> None:
    with working(learner.endpoint) as worker:
        learner.ready()
        learner.link.close()
        with TinyLearner(learner.endpoint, run="run-2"):
            assert worker.end() == End(0, "run run-2 has begun instead")


def test_a_worker_that_stays_for_ever_joins_the_next_run(learner: TinyLearner) -> None:
    with working(learner.endpoint, forever=True) as worker:
        hello = learner.ready()
        learner.stop()
        learner.next(Bye)
        learner.link.close()
        with TinyLearner(learner.endpoint, run="run-2") as second:
            again = second.ready()
            assert again.boot == hello.boot
            second.give(again, 1, [1.0, 0.0])
            assert second.take().cost == 1.0
            second.say(Refused(boot=again.boot, why="enough"))
            assert worker.end() == End(4, "enough")


def test_hold_keeps_waiting_trials_from_beginning_until_resume(learner: TinyLearner) -> None:
    with working(learner.endpoint):
        hello = learner.ready()
        learner.say(Command(kind=CommandKind.HOLD))
        trial = learner.give(hello, 1, [1.0, 0.0])
        assert learner.next(Renew).tokens == [trial.token]
        learner.say(Command(kind=CommandKind.RESUME))
        assert learner.take().cost == 1.0
        assert not [m for m in learner.heard[:-1] if isinstance(m, Result)]
        learner.stop()


def test_a_silent_learner_is_asked_again(learner: TinyLearner) -> None:
    learner.lease_s = 0.2
    with working(learner.endpoint):
        hello = learner.ready()
        again = learner.next(Hello)
        assert (again.boot, again.credits, again.engine) == (hello.boot, 2, "bowl 1")
        learner.stop()


def test_where_no_learner_is_the_worker_says_so() -> None:
    endpoint = free_endpoint()
    with working(endpoint, wait_s=0.1) as worker:
        end = worker.end()
        assert end.code == 3
        assert f"nobody answers at {endpoint}" in end.why


def test_a_name_that_cannot_stand_in_a_key_is_refused() -> None:
    with pytest.raises(ConfigError, match="evaluator name"):
        run_worker(WorkerConfig(connect="tcp/h:1", name="a/b"), BOWL)
    assert check_name(default_name())


# -- signals need a process of their own --------------------------------------------------------

_PROCESS = """
    import os, sys
    sys.path.insert(0, sys.argv[2])
    from shearline.evaluator.tasks import load_task
    from shearline.evaluator.worker import WorkerConfig, run_worker
    end = run_worker(WorkerConfig(connect=sys.argv[1], name="lab-1"), load_task(sys.argv[3]))
    print(end.why, flush=True)
    os._exit(end.code)
"""


_BUSY = """
    from shearline.evaluator.tasks import task
    @task(space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)}, trial_s=600.0)
    def busy(theta, rng):
        while True:
            pass
"""


@contextmanager
def process(endpoint: str, folder: Path, task: str) -> Iterator[subprocess.Popen[str]]:
    (folder / "busy.py").write_text(textwrap.dedent(_BUSY))
    command = [sys.executable, "-c", textwrap.dedent(_PROCESS), endpoint, str(folder), task]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as child:
        yield child
        child.kill()


@pytest.mark.parametrize("task", ["sleep-60000", "busy:busy"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_process_soon_whatever_runs(
    learner: TinyLearner, tmp_path: Path, task: str, number: signal.Signals
) -> None:
    with process(learner.endpoint, tmp_path, task) as child:
        hello = learner.ready()
        learner.give(hello, 1, [1.0, 0.0], deadline_s=600.0)
        learner.next(Renew)
        child.send_signal(number)
        if task != "busy:busy":
            assert learner.take(Verdict.NOTED).kind is OutcomeKind.ABORTED
        assert learner.next(Bye).why == f"interrupted by {number.name}"
        assert child.wait(WAIT_S) == 130


def test_a_second_signal_ends_the_process_at_once(learner: TinyLearner, tmp_path: Path) -> None:
    with process(learner.endpoint, tmp_path, "busy:busy") as child:
        hello = learner.ready()
        learner.give(hello, 1, [1.0, 0.0], deadline_s=600.0)
        learner.next(Renew)
        learner.link.close()  # nobody takes the worker's leave
        child.send_signal(signal.SIGINT)
        child.send_signal(signal.SIGTERM)
        assert child.wait(WAIT_S) == 130


def test_a_signal_ends_the_wait_for_a_learner(tmp_path: Path) -> None:
    with process(free_endpoint(), tmp_path, "sleep-1") as child:
        while not _catches(child.pid, signal.SIGTERM):
            pass
        child.send_signal(signal.SIGTERM)
        assert child.wait(WAIT_S) == 130


def _catches(pid: int, number: signal.Signals) -> bool:
    """Tell from the kernel whether a process has a handler for a signal."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    caught = next(line for line in status.splitlines() if line.startswith("SigCgt"))
    return bool(int(caught.split()[1], 16) >> (number - 1) & 1)
