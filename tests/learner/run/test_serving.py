"""A run over the real network: from the folder to the summary, and back again after an end."""

from __future__ import annotations

import contextlib
import json
import resource
import threading
import tomllib
from collections.abc import Iterator
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import msgspec
import pytest
from simulation.light import LightEvaluator, succeed

from shearline.learner.dispatcher import Book
from shearline.learner.dispatcher.entries import LearnerBooted, ResultTaken
from shearline.learner.run.config import RunConfig
from shearline.learner.run.journal import read
from shearline.learner.run.serving import serve
from shearline.learner.run.summary import RunSummary
from shearline.protocol.codec import TO_OBSERVER, decode, encode
from shearline.protocol.discovery import discover
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import ConfigError, LinkError, RecordError, ShearlineError
from shearline.protocol.intake import Arrival
from shearline.protocol.keys import Keys
from shearline.protocol.link import open_client, open_router
from shearline.protocol.messages import (
    Command,
    CommandKind,
    Counted,
    EpisodeClosed,
    Message,
    OutcomeKind,
    Proposed,
    Snapshot,
    Status,
    Trial,
    Wire,
)
from shearline.protocol.task import TaskSpec

TASK = TaskSpec(name="ball", space={"x": ("m", -1.0, 1.0), "y": ("m", -1.0, 1.0)}, trial_s=5.0)
CONFIG = RunConfig(task=TASK, learner="lhs", episodes=3, trials=5, record=False)


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@contextlib.contextmanager
def lights(endpoint: str, *names: str, **how: Any) -> Iterator[list[LightEvaluator]]:
    """Have light evaluators there while the block lasts."""
    found = [LightEvaluator(endpoint, name, **how) for name in names]
    for light in found:
        light.start()
    yield found
    for light in found:
        light.join(10.0)
        assert not light.is_alive()


def run_with(config: RunConfig, folder: Path, endpoint: str, *names: str, **how: Any) -> RunSummary:
    """Lead a run with light evaluators to its end."""
    with lights(endpoint, *names, **how):
        return serve(config, folder, endpoint)


def stop_after(count: int, endpoint: str) -> Any:
    """Return an answer that has the operator stop the run after so many trials."""
    done = SimpleQueue[int]()

    def answer(trial: Trial) -> tuple[OutcomeKind, float, str]:
        done.put(trial.trial)
        if done.qsize() == count:
            command(endpoint, CommandKind.STOP)
        return succeed(trial)

    return answer


def command(endpoint: str, kind: CommandKind) -> None:
    """Speak as the operator."""
    with open_client(endpoint) as link:
        run, _ = discover(link)
        link.publish(Keys(run).op_cmd(), encode(Command(kind=kind, why="test")))


def thetas(folder: Path) -> dict[int, list[float]]:
    """Return what each trial of a run proposed."""
    return {n: row.theta for n, row in Book.of(read(folder / "journal")).trials.items()}


def test_a_run_counts_every_trial_once_and_leaves_its_folder_whole(
    tmp_path: Path, endpoint: str
) -> None:
    folder = tmp_path / "run-1"
    summary = run_with(CONFIG, folder, endpoint, "a", "b")
    assert (summary.run, summary.state, summary.counted, summary.lost) == (
        "run-1",
        "complete",
        15,
        0,
    )
    assert [(e.episode, e.trials) for e in summary.episodes] == [(0, 5), (1, 5), (2, 5)]
    assert summary.recommendation is not None
    assert set(summary.recommendation.theta) == {"x", "y"}
    assert json.loads((folder / "summary.json").read_text()) == json.loads(
        json.dumps(summary.to_dict())
    )
    assert tomllib.loads((folder / "run.toml").read_text())["task"]["name"] == "ball"
    assert "the run is complete" in (folder / "learner.log").read_text()
    assert Book.of(read(folder / "journal")).tally.counted == 15


def test_observers_hear_everything(tmp_path: Path, endpoint: str) -> None:
    heard: SimpleQueue[Arrival] = SimpleQueue()
    listening = threading.Event()
    statuses: list[Status] = []

    def observe() -> None:
        with open_client(endpoint, 10.0) as link:
            link.subscribe(Keys("run-1").observed(), heard)
            listening.set()
            ended.wait(20.0)

    ended = threading.Event()
    observer = threading.Thread(target=observe)
    observer.start()

    def answer(trial: Trial) -> tuple[OutcomeKind, float, str]:
        assert listening.wait(10.0)
        return succeed(trial)

    config = msgspec.structs.replace(CONFIG, record=True)
    with lights(endpoint, "a", answer=answer):
        serve(config, tmp_path / "run-1", endpoint, on_status=statuses.append)
    ended.set()
    observer.join(10.0)
    messages = [decode(heard.get().payload, *TO_OBSERVER) for _ in range(heard.qsize())]
    kinds: dict[type[Message], list[Message]] = {}
    for message in messages:
        kinds.setdefault(type(message), []).append(message)
    assert len(kinds[Counted]) == 15
    assert len(kinds[EpisodeClosed]) == 3
    assert len(kinds[Proposed]) >= 10
    assert len(kinds[Snapshot]) >= 2
    # A trial and a result each; most acknowledgements travel with a trial.
    assert len(kinds[Wire]) >= 30
    assert isinstance(messages[-1], Status)
    assert messages[-1].state == statuses[-1].state == "ended"
    assert statuses[-1].counted == 15
    assert 0.0 < statuses[-1].step_ms_max < 1000.0


@pytest.mark.parametrize("learner", ["random", pytest.param("psp", marks=pytest.mark.slow)])
def test_a_stopped_run_goes_on_and_proposes_what_an_undisturbed_one_does(
    tmp_path: Path, endpoint: str, learner: str
) -> None:
    config = msgspec.structs.replace(CONFIG, learner=learner, episodes=3, trials=6)
    whole = run_with(config, tmp_path / "whole", endpoint, "a")
    torn = tmp_path / "torn"
    for stop in (2, 7):
        halted = run_with(config, torn, endpoint, "a", answer=stop_after(stop, endpoint))
        assert halted.state == "stopped"
        assert "test" in halted.why
    acked = [e for e in read(torn / "journal") if isinstance(e, ResultTaken)]
    with lights(endpoint, "a"):
        resumed = serve(config, torn, endpoint, resume=True)
    assert (resumed.state, resumed.counted, resumed.lost) == ("complete", 18, 0)
    assert thetas(torn) == thetas(tmp_path / "whole")
    entries = list(read(torn / "journal"))
    assert [e for e in entries if isinstance(e, ResultTaken)][: len(acked)] == acked
    assert [e.epoch for e in entries if isinstance(e, LearnerBooted)] == [1, 2, 3]
    assert resumed.recommendation == whole.recommendation


def test_a_task_that_always_aborts_fails_the_run_with_its_words(
    tmp_path: Path, endpoint: str
) -> None:
    def answer(_trial: Trial) -> tuple[OutcomeKind, float, str]:
        return OutcomeKind.ABORTED, 0.0, "ZeroDivisionError: division by zero"

    summary = run_with(CONFIG, tmp_path / "r", endpoint, "a", answer=answer)
    assert summary.state == "failed"
    assert "ZeroDivisionError: division by zero" in summary.why
    assert summary.aborted == 15


def test_an_evaluator_that_vanishes_costs_the_run_nothing_but_its_trial(
    tmp_path: Path, endpoint: str
) -> None:
    with lights(endpoint, "brief", last=3), lights(endpoint, "a", "b"):
        summary = serve(CONFIG, tmp_path / "r", endpoint)
    assert (summary.counted, summary.lost) == (15, 0)


def test_garbage_and_forgeries_are_ignored(tmp_path: Path, endpoint: str) -> None:
    def rogue() -> None:
        with open_client(endpoint, 10.0) as link:
            run, _ = discover(link, 10.0)
            root = Keys(run).root
            for n in range(300):
                link.publish(f"{root}/ev/a/result", bytes([n % 256]) * n)
                link.publish(f"{root}/ev/a/hello", b"\xc0")
                link.publish(f"{root}/op/cmd", b"\x81\xa4type\xa4stop")

    thread = threading.Thread(target=rogue)
    thread.start()
    summary = run_with(CONFIG, tmp_path / "r", endpoint, "a")
    thread.join(10.0)
    assert (summary.state, summary.counted) == ("complete", 15)


def test_the_operator_holds_and_resumes(tmp_path: Path, endpoint: str) -> None:
    states: list[str] = []
    answered: list[int] = []
    resumed = threading.Event()

    def answer(trial: Trial) -> tuple[OutcomeKind, float, str]:
        answered.append(trial.trial)
        if len(answered) == 2:
            command(endpoint, CommandKind.HOLD)
        return succeed(trial)

    def watch(status: Status) -> None:
        states.append(status.state)
        if status.state == "held" and status.leased == 0 and not resumed.is_set():
            resumed.set()
            threading.Thread(target=command, args=(endpoint, CommandKind.RESUME)).start()

    with lights(endpoint, "a", answer=answer):
        summary = serve(CONFIG, tmp_path / "r", endpoint, on_status=watch)
    assert "held" in states
    assert (summary.state, summary.counted) == ("complete", 15)


def test_a_taken_endpoint_is_one_sentence(tmp_path: Path, endpoint: str) -> None:
    with open_router(endpoint), pytest.raises(LinkError, match="it is taken"):
        serve(CONFIG, tmp_path / "r", endpoint)


@pytest.mark.parametrize(
    ("changes", "error", "why"),
    [
        ({"learner": "oracle"}, ConfigError, "no learner is called 'oracle'"),
        ({"seed": 4}, ConfigError, "holds another run, its seed is 0, not 4"),
        ({}, ConfigError, "has ended: choose another folder"),
    ],
)
def test_a_finished_foreign_or_impossible_run_is_refused(
    finished: Path, endpoint: str, changes: dict[str, Any], error: type[ShearlineError], why: str
) -> None:
    if "seed" in changes:
        finished = unfinished(finished)
    with pytest.raises(error, match=why):
        serve(msgspec.structs.replace(CONFIG, **changes), finished, endpoint)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a run that has ended."""
    folder = tmp_path_factory.mktemp("runs") / "done"
    run_with(CONFIG, folder, free_endpoint(), "a")
    return folder


def unfinished(finished: Path) -> Path:
    """Return the folder of the same run, torn before its end."""
    folder = finished.with_name("torn")
    folder.mkdir()
    data = (finished / "journal").read_bytes()
    (folder / "journal").write_bytes(data[: len(data) // 2])
    return folder


def test_there_must_be_something_to_resume(tmp_path: Path, endpoint: str) -> None:
    with pytest.raises(ConfigError, match="there is no run to resume"):
        serve(CONFIG, tmp_path / "r", endpoint, resume=True)
    assert not (tmp_path / "r").exists()


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path, endpoint: str) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordError, match="cannot make"):
        serve(CONFIG, tmp_path / "file" / "r", endpoint)


def test_a_journal_without_its_head_is_refused(
    finished: Path, tmp_path: Path, endpoint: str
) -> None:
    data = (finished / "journal").read_bytes()
    length = int.from_bytes(data[8:12], "little")
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / "journal").write_bytes(data[:8] + data[16 + length :])
    with pytest.raises(RecordError, match="has lost its head"):
        serve(CONFIG, tmp_path / "r", endpoint)


def test_a_full_disk_ends_the_run_in_one_sentence_with_nothing_unwritten_acknowledged(
    tmp_path: Path, endpoint: str
) -> None:
    config = msgspec.structs.replace(CONFIG, trials=40)
    light = LightEvaluator(endpoint, "a")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    light.start()
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with pytest.raises(RecordError, match="cannot write the journal"):
            serve(config, tmp_path / "r", endpoint)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    kept = {e.result.token for e in read(tmp_path / "r" / "journal") if isinstance(e, ResultTaken)}
    assert len(light.verdicts) > 0
    assert set(light.verdicts) <= kept
    summary = run_with(config, tmp_path / "r", endpoint, "b")
    light.join(10.0)
    assert (summary.state, summary.counted) == ("complete", 120)


def test_a_torn_journal_is_cut_where_it_is_damaged_and_the_run_goes_on(
    finished: Path, tmp_path: Path, endpoint: str
) -> None:
    folder = tmp_path / "r"
    folder.mkdir()
    data = (finished / "journal").read_bytes()
    (folder / "journal").write_bytes(data[: 2 * len(data) // 3] + b"torn")
    summary = run_with(CONFIG, folder, endpoint, "a")
    assert (summary.state, summary.counted) == ("complete", 15)
    assert "damaged bytes off the end" in (folder / "learner.log").read_text()
