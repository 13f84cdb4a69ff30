"""Trials verified by many processes: in order, and with nothing left behind."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Generator, Iterator
from pathlib import Path

import pytest

from shearline.deploy.replay.many import AHEAD, WorkerDied, verify_all
from shearline.deploy.replay.recorded import Recorded
from shearline.evaluator.replay import Case
from shearline.record.reader import open_run

OWN = """
import os
from shearline.evaluator import task

@task(space={"x": ("m", -5.0, 5.0)})
def fatal(theta, rng):
    if os.path.exists("now"):
        os._exit(1)
    return theta["x"], True
"""


@pytest.fixture(scope="module")
def cases(sphere_run: Path) -> list[Case]:
    return list(Recorded(open_run(sphere_run)).cases())


def test_one_process_is_this_one(cases: list[Case]) -> None:
    verified = list(verify_all("sphere", cases, workers=1))
    assert [one.trial for one in verified] == [0, 1, 2, 3]
    assert all(one.identical for one in verified)


@pytest.mark.slow
def test_no_more_cases_are_taken_than_can_be_under_way(cases: list[Case]) -> None:
    taken = []

    def counted() -> Iterator[Case]:
        for case in cases * 5:
            taken.append(case)
            yield case

    verified = verify_all("sphere", counted(), workers=2)
    for done in range(1, 6):
        next(verified)
        assert len(taken) <= done + 2 * AHEAD
    assert isinstance(verified, Generator)
    verified.close()
    assert not multiprocessing.active_children()


@pytest.mark.slow
def test_a_process_that_is_killed_is_one_sentence(
    record: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "fatal_task.py").write_text(OWN)
    run = open_run(record(tmp_path / "run", "fatal_task:fatal"))
    (tmp_path / "now").touch()
    with pytest.raises(WorkerDied, match="fewer --workers"):
        list(verify_all("fatal_task:fatal", Recorded(run).cases(), workers=2))
    assert not multiprocessing.active_children()
