"""Goal: a run that was killed proposes what an undisturbed one proposes.

Method: lead a run with a real folder, journal, dispatcher and learner, but no network; cut its
journal wherever a kill could have ended it, lead it to its end from there, and compare. The
evaluator that resumes is another one, and reports in another order.
"""

from __future__ import annotations

import itertools
import shutil
import struct
from collections import deque
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shearline.learner.dispatcher import Book, Dispatcher
from shearline.learner.dispatcher.events import (
    Begin,
    EvaluatorGone,
    Event,
    HelloReceived,
    LearnerFailed,
    ResultReceived,
)
from shearline.learner.dispatcher.instructions import Ask, EndRun, Instruction, Journal, Send, Told
from shearline.learner.registry import create
from shearline.learner.run.config import RunConfig
from shearline.learner.run.fitter import Fitter, Modelled, Recommended
from shearline.learner.run.folder import JOURNAL, Folder
from shearline.learner.run.journal import MAGIC
from shearline.protocol.messages import VERSION, Hello, OutcomeKind, Result, Trial
from shearline.protocol.task import TaskSpec

TASK = TaskSpec(name="ball", space={"x": ("m", -1.0, 1.0), "y": ("m", -1.0, 1.0)}, trial_s=5.0)
#: psp takes seconds to be imported and told; lhs shows the same of everything but the learner.
LEARNERS = ("lhs", pytest.param("psp", marks=pytest.mark.slow))


def config_of(learner: str) -> RunConfig:
    """Return a run long enough for the learner to have learned something."""
    return RunConfig(
        task=TASK,
        learner=learner,
        episodes=4,
        trials=6,
        seed=3,
        record=False,
        confirm=3,
        confirm_region=3,
    )


class Course(NamedTuple):
    """What a run proposed, told its learner, and recommended."""

    proposed: dict[int, tuple[list[float], int]]
    told: list[tuple[Told, ...]]
    recommended: list[float]
    radius: list[float]


class Leading:
    """One life of a learner process, led by hand.

    Args:
        folder: Held run folder.
        config: The run's.
        evaluator: The only one there is.
        newest_first: Whether it runs first what it was given last.
    """

    def __init__(
        self, folder: Folder, config: RunConfig, evaluator: str, *, newest_first: bool
    ) -> None:
        self.folder = folder
        self.evaluator = evaluator
        self.newest_first = newest_first
        self.inbox: SimpleQueue[Any] = SimpleQueue()
        self.numbers = itertools.count()
        self.dispatcher = Dispatcher(config.rules(), self._token, folder.book)
        self.fitter = Fitter(
            lambda: create(config.learner, config.space, config.trials, config.seed),
            config.seed,
            self.inbox,
        )
        self.given: deque[Trial] = deque()
        self.ended = False

    def lead(self) -> Course:
        """Lead the run to its end."""
        dead = {(a.evaluator, a.boot) for a in self.dispatcher.book.live.values()}
        self.fitter.start(self.dispatcher.book)
        self._do(Begin())
        self._do(HelloReceived(self.evaluator, self._hello()))
        for name, boot in dead:
            self._do(EvaluatorGone(name, boot))
        while not self.ended:
            self._do(self._result(self._next()) if self.given else self._answer())
        while not isinstance(last := self.inbox.get(timeout=60), Recommended):
            pass
        assert last.recommendation is not None
        region = last.recommendation.region
        book = self.dispatcher.book
        return Course(
            {n: (row.theta, row.seed) for n, row in book.trials.items()},
            book.told,
            last.recommendation.theta.tolist(),
            [] if region is None else region.radius.tolist(),
        )

    def _do(self, event: Event) -> None:
        out = self.dispatcher.handle(event, 0.0)
        self.folder.journal.append([i.entry for i in out if isinstance(i, Journal)])
        for instruction in out:
            self._carry_out(instruction)

    def _carry_out(self, instruction: Instruction) -> None:
        match instruction:
            case Send(_, Trial() as trial):
                self.given.append(trial)
            case Ask():
                self.fitter.ask(instruction)
            case EndRun(tells=tells):
                self.fitter.finish(tells)
                self.ended = True
            case _:
                pass

    def _next(self) -> Trial:
        return self.given.pop() if self.newest_first else self.given.popleft()

    def _answer(self) -> Event:
        while isinstance(item := self.inbox.get(timeout=60), Modelled):
            pass
        assert not isinstance(item, LearnerFailed), item
        assert isinstance(item, Event)
        return item

    def _token(self) -> str:
        return f"{self.dispatcher.book.epoch:04d}-{next(self.numbers):08d}"

    def _hello(self) -> Hello:
        return Hello(
            boot=f"boot-of-{self.evaluator}",
            version=VERSION,
            task_digest="",
            kind="function",
            engine="",
            credits=2,
        )

    def _result(self, trial: Trial) -> ResultReceived:
        cost = sum(x * x for x in trial.theta)
        kind = OutcomeKind.SUCCESS if cost < 0.6 else OutcomeKind.FAILURE
        result = Result(
            boot=f"boot-of-{self.evaluator}",
            token=trial.token,
            trial=trial.trial,
            kind=kind,
            cost=cost,
            seed=trial.seed,
        )
        return ResultReceived(self.evaluator, result)


def course(path: Path, learner: str, evaluator: str = "first", *, newest_first: bool) -> Course:
    """Lead the run in a folder to its end, from wherever it stands."""
    config = config_of(learner)
    with Folder(path, config) as folder:
        return Leading(folder, config, evaluator, newest_first=newest_first).lead()


@pytest.fixture(scope="module", params=LEARNERS)
def undisturbed(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Path, Course]:
    """Return a learner, the folder of a run that nothing disturbed, and what came of it."""
    path = tmp_path_factory.mktemp("undisturbed") / "run"
    return request.param, path, course(path, request.param, newest_first=False)


def ends(data: bytes) -> list[int]:
    """Return where each record of a journal ends, from the file's head on."""
    at, found = len(MAGIC), [len(MAGIC)]
    while at < len(data):
        at += 8 + struct.unpack_from("<I", data, at)[0]
        found.append(at)
    return found


def assert_resumes(undisturbed: tuple[str, Path, Course], cut: int, scratch: Path) -> None:
    """Cut the journal there, resume, and compare."""
    learner, path, expected = undisturbed
    scratch.mkdir()
    (scratch / JOURNAL).write_bytes((path / JOURNAL).read_bytes()[:cut])
    try:
        assert course(scratch, learner, "second", newest_first=True) == expected
    finally:
        shutil.rmtree(scratch)


@settings(max_examples=8)
@given(share=st.floats(0.0, 1.0, exclude_max=True))
def test_a_run_killed_anywhere_proposes_what_an_undisturbed_one_does(
    undisturbed: tuple[str, Path, Course],
    tmp_path_factory: pytest.TempPathFactory,
    share: float,
) -> None:
    last = ends((undisturbed[1] / JOURNAL).read_bytes())[-2]
    scratch = tmp_path_factory.mktemp("killed") / "run"
    assert_resumes(undisturbed, int(share * (last + 1)), scratch)


@pytest.mark.slow
def test_a_run_killed_after_or_within_any_record_does(
    undisturbed: tuple[str, Path, Course], tmp_path: Path
) -> None:
    boundaries = ends((undisturbed[1] / JOURNAL).read_bytes())[:-1]
    for start, end in itertools.pairwise(boundaries):
        for cut in (start, start + 5, (start + end) // 2, end - 1):
            assert_resumes(undisturbed, cut, tmp_path / "run")


def test_the_comparison_can_fail(
    undisturbed: tuple[str, Path, Course], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        Book, "tells", lambda book: tuple(Told(t.trial, 1.0, success=False) for t in book.untold)
    )
    learner, path, expected = undisturbed
    middle = ends((path / JOURNAL).read_bytes())[12]
    (tmp_path / JOURNAL).write_bytes((path / JOURNAL).read_bytes()[:middle])
    assert course(tmp_path, learner, "second", newest_first=True) != expected
