"""What is owed, and under which name."""

from __future__ import annotations

from pathlib import Path

import pytest

from shearline.evaluator.robot.spool import Spool
from shearline.evaluator.worker import default_name
from shearline.protocol.errors import ConfigError
from shearline.protocol.keys import check_name
from shearline.protocol.messages import OutcomeKind, Result


def measured(token: str = "token-0001") -> Result:
    return Result(
        boot="boot-0001", token=token, trial=1, kind=OutcomeKind.SUCCESS, cost=2.0, seed=1
    )


def test_a_result_is_kept_until_it_is_dropped_and_belongs_to_one_run(tmp_path: Path) -> None:
    Spool(tmp_path / "spool").put("run-1", measured())
    spool = Spool(tmp_path / "spool")
    assert spool.pending("run-1") == [measured()]
    assert spool.pending("run-2") == []
    spool.drop("token-0001")
    assert spool.pending("run-1") == []


def test_results_are_delivered_under_the_name_they_were_measured_under(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    spool.expect("left")
    spool.own("left")
    spool.expect("right")  # nothing is owed yet
    spool.put("run-1", measured())
    Spool(tmp_path).expect("left")
    with pytest.raises(ConfigError, match="--name left"):
        Spool(tmp_path).expect("right")
    spool.drop("token-0001")
    spool.expect("right")


def test_two_robots_of_one_machine_have_two_names_and_keep_them(tmp_path: Path) -> None:
    paths = [str(tmp_path / f"lab-robot-arm-{side}.toml") for side in ("left", "right")]
    names = [check_name(default_name(path)) for path in paths]
    assert len(set(names)) == 2
    assert names == [default_name(path) for path in paths]
    assert default_name(str(tmp_path / "a" / "lab.toml")) != default_name(
        str(tmp_path / "lab.toml")
    )
