"""The worker against a real router: how it joins a run, keeps to its learner, and ends."""

import threading

import pytest
from evaluator.tiny_learner import BOWL, NAME, WAIT_S, TinyLearner, working

from shearline.evaluator.builtin import BowlTask
from shearline.evaluator.postman import End
from shearline.evaluator.worker import WorkerConfig, default_name, run_worker
from shearline.protocol.codec import encode
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import ConfigError
from shearline.protocol.keys import check_name
from shearline.protocol.messages import (
    Bye,
    Command,
    CommandKind,
    Hello,
    OutcomeKind,
    Refused,
    Renew,
    Result,
)
from shearline.protocol.task import TaskSpec


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
