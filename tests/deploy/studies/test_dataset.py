"""One set of runs behind all tables: what is there is read, what is missing is run, once."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from shearline.deploy.cli import main
from shearline.deploy.exits import Exit
from shearline.deploy.studies.contenders import CONTENDERS, contender
from shearline.deploy.studies.dataset import CODE, Gathering, Size, Wanted
from shearline.deploy.studies.lanes import Effort, Lanes, is_complete
from shearline.deploy.studies.trials_of import ran
from shearline.evaluator.builtin import builtin_spec
from shearline.learner.dispatcher.entries import ResultTaken
from shearline.learner.registry import create
from shearline.learner.run.config import to_toml
from shearline.learner.run.journal import read
from shearline.protocol.errors import ConfigError, RecordError
from shearline.protocol.messages import Purpose
from shearline.protocol.space import Space
from shearline.studies.experiment import SPREADS

SIZE = Size(episodes=2, trials=5, fresh=4, around=2)


def wanted(name: str = "random", seed: int = 0, size: Size = SIZE) -> Wanted:
    return Wanted(contender(name), "sleep-0", "mujoco", seed, size)


@pytest.mark.parametrize("name", CONTENDERS)
def test_every_contender_can_be_made_for_the_lock(name: str) -> None:
    space = Space(builtin_spec("keylock").space)
    one = contender(name)
    learner = create(one.learner, space, 20, 0, **one.switches(space, 40))
    assert len(learner.ask(20)) == 20


def test_centre_push_tries_one_tuple_only() -> None:
    space = Space(builtin_spec("keylock").space)
    tuples = contender("centre-push").switches(space, 3)["tuples"]
    assert isinstance(tuples, list)
    assert len(tuples) == 3
    named = space.to_dict(tuples[0])
    assert (named["ins_push"], round(named["xi"], 9)) == (19.0, 0.75)


def test_an_unknown_contender_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected some of psp-ranked"):
        contender("sgd")


def test_whatever_decides_a_run_decides_its_folder(tmp_path: Path) -> None:
    one = wanted()
    others = [
        wanted(seed=1),
        wanted("ga"),
        wanted(size=replace(SIZE, fresh=5)),
        replace(one, task="sleep-1"),
        replace(one, plant="pybullet"),
    ]
    folders = {other.folder(tmp_path, other.learning()) for other in [one, *others]}
    assert len(folders) == 6
    assert one.folder(tmp_path, one.learning()) in folders


@pytest.mark.parametrize(("text", "complete"), [('{"state": "complete"}', True),
                                                ('{"state": "stopped"}', False)])  # fmt: skip
def test_a_run_that_was_stopped_is_not_complete(tmp_path: Path, text: str, complete: bool) -> None:  # noqa: FBT001 - a parameter of the test
    assert not is_complete(tmp_path)
    (tmp_path / "summary.json").write_text(text)
    assert is_complete(tmp_path) is complete


def test_a_summary_that_cannot_be_read_is_said(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text("{")
    with pytest.raises(RecordError, match="cannot read the summary"):
        is_complete(tmp_path)


def test_the_ratio_takes_the_lesser_account_of_the_trials() -> None:
    effort = Effort(runs=3, wall_s=60.0, evaluators_cpu_s=100.0, cpu_s=108.0, lanes=2)
    assert effort.ratio(110.0) == pytest.approx(1.2)
    assert effort.ratio(96.0) == pytest.approx(1.25)


@pytest.mark.slow
def test_experiments_are_run_once_and_the_same_alone_or_side_by_side(tmp_path: Path) -> None:
    both = [wanted(seed=0), wanted(seed=1)]
    gathering = Gathering(tmp_path / "both", 2, quiet=True)
    found = gathering.experiments(both, tried=True)
    assert [(one.seed, one.learned.trials, one.fresh.trials) for one in found] == [
        (0, 10, 4),
        (1, 10, 4),
    ]
    assert [part.trials for part in found[0].around] == [2] * len(SPREADS)
    assert found[0].again.trials == 4
    assert found[0].again.cost == [pytest.approx(found[0].optimised)] * 4  # nothing is noisy here
    assert [effort.runs for effort, _ in gathering.efforts] == [2, 2]
    again = Gathering(tmp_path / "both", 2, quiet=True)
    assert again.experiments(both, tried=True) == found
    assert not again.efforts
    (alone,) = Gathering(tmp_path / "alone", 1, quiet=True).experiments(both[1:])
    assert alone.learned == found[1].learned


@pytest.mark.slow
def test_a_study_that_was_interrupted_goes_on_where_it_was(tmp_path: Path) -> None:
    asked = [sys.executable, "-m", "shearline.deploy", "study", "table2", "--level", "sleep-20"]
    asked += ["--learners", "random", "--experiments", "2", "--episodes", "2", "--trials", "20"]
    asked += ["--fresh", "20", "--workers", "1", "--no-picture", "--json", "--out", str(tmp_path)]
    with subprocess.Popen(asked, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as study:
        journals = tmp_path.glob("runs/*/*-00-*/journal")
        while not any(journal.stat().st_size > 4000 for journal in journals):
            assert study.poll() is None
            journals = tmp_path.glob("runs/*/*-00-*/journal")
        study.send_signal(signal.SIGINT)
        assert study.wait(30) == Exit.INTERRUPTED
    done = json.loads(subprocess.run(asked, check=True, capture_output=True).stdout)
    assert [len(one["learned"]["cost"]) for one in done["experiments"]] == [40, 40]
    assert all(one["fresh"]["success"] for one in done["experiments"])


@pytest.mark.slow
def test_a_learner_and_an_evaluator_that_are_killed_are_started_again(tmp_path: Path) -> None:
    one = replace(wanted(size=replace(SIZE, trials=20)), task="sleep-20")
    folder = one.folder(tmp_path, one.learning())
    lanes = Lanes(tmp_path, [folder], 1, "mujoco", lambda _: None)
    folder.mkdir(parents=True)
    (folder / "run.toml").write_text(to_toml(one.learning()))
    killed = threading.Thread(target=kill_both, args=(lanes, folder))
    killed.start()
    assert lanes.run().runs == 1
    killed.join()
    assert ran(folder).outcomes(Purpose.LEARNING).trials == 40


@pytest.mark.slow
def test_an_evaluator_without_a_run_joins_one_that_goes_on(tmp_path: Path) -> None:
    folders = []
    for trials in (5, 100):
        one = replace(wanted(size=replace(SIZE, trials=trials)), task="sleep-20")
        folders.append(one.folder(tmp_path, one.learning()))
        folders[-1].mkdir(parents=True)
        (folders[-1] / "run.toml").write_text(to_toml(one.learning()))
    assert Lanes(tmp_path, folders, 2, "mujoco", lambda _: None).run().lanes == 2
    ran_by = [
        {e.evaluator for e in read(folder / "journal") if isinstance(e, ResultTaken)}
        for folder in folders
    ]
    assert ran_by == [{"evaluator-0"}, {"evaluator-0", "evaluator-1"}]


def kill_both(lanes: Lanes, folder: Path) -> None:
    """Kill learner and evaluator of the only lane once trials are being run."""
    journal = folder / "journal"
    while not (journal.exists() and journal.stat().st_size > 4000):
        pass
    for child in list(lanes.children()):
        child.process.kill()


@pytest.mark.slow
def test_results_of_other_code_are_said_and_renewed_when_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gathering = Gathering(tmp_path, 1, quiet=True)
    gathering.experiments([wanted()])
    folder = wanted().folder(tmp_path, wanted().learning())
    (folder / CODE).write_text("older")
    gathering.experiments([wanted()])
    assert "1 runs (random) were made by other code" in capsys.readouterr().err
    assert len(gathering.efforts) == 1
    renewing = Gathering(tmp_path, 1, quiet=True, renew=True)
    renewing.experiments([wanted()])
    assert len(renewing.efforts) == 1


@pytest.mark.slow
def test_studies_share_their_runs_and_print_data_for_programs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["--level", "sleep-0", "--learners", "random", "centre-push", "--experiments", "2"]
    asked += ["--episodes", "2", "--trials", "5", "--fresh", "4", "--around", "2", "--json"]
    for name, stretches in {"reliability": 2, "table1": 0, "table2": 0}.items():
        assert main(["study", name, *asked, "--no-picture", "--out", str(tmp_path)]) == Exit.OK
        data = json.loads(capsys.readouterr().out)
        assert len(data["efforts"]) == stretches
        assert [one["contender"] for one in data["curves"]] == ["random", "centre-push"]
        assert data["tables"][0]["rows"][1][0] == "centre-push"


@pytest.mark.slow
def test_transfer_tries_every_recommendation_in_every_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["study", "transfer", "--learner", "random", "--tasks", "sleep-0", "sleep-1"]
    asked += ["--experiments", "1", "--episodes", "1", "--trials", "6", "--fresh", "3", "--json"]
    assert main([*asked, "--out", str(tmp_path)]) == Exit.OK
    data = json.loads(capsys.readouterr().out)
    places = [(one["learned"][1], one["tried"][1]) for one in data["travelled"]]
    assert sorted(places) == [
        (a, b) for a in ("sleep-0", "sleep-1") for b in ("sleep-0", "sleep-1")
    ]
    assert all(len(one["outcomes"]["success"]) == 3 for one in data["travelled"])
    assert data["tables"][0]["head"] == ["learned on", "on mujoco, sleep-0", "on mujoco, sleep-1"]
