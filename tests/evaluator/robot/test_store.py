"""What survives at the robot, and what is refused because it did not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from shearline.evaluator.robot import store as stores
from shearline.evaluator.robot.bounds import ToolTable
from shearline.evaluator.robot.errors import RobotRefused
from shearline.evaluator.robot.spool import Spool
from shearline.evaluator.robot.store import Calibration, Store, Wear
from shearline.protocol.messages import OutcomeKind, Result


def result(token: str, trial: int = 0) -> Result:
    return Result(
        boot="boot-0001", token=token, trial=trial, kind=OutcomeKind.SUCCESS, cost=1.5, seed=3
    )


def test_one_process_at_a_time_holds_the_folder(store: Store) -> None:
    with pytest.raises(RobotRefused, match="another process"):
        Store(store.folder)
    store.close()
    Store(store.folder).close()


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RobotRefused, match="cannot be written"):
        Store(tmp_path / "file")


def test_wear_counts_what_was_used_and_forgets_what_was_replaced(store: Store) -> None:
    assert store.wear() == Wear()
    store.set_wear(store.wear().used("key", "lock").used("key", "lock"))
    assert store.wear() == Wear({"key": 2, "lock": 2}, 2)
    store.set_wear(store.wear().replaced("key").tested())
    assert store.wear() == Wear({"key": 0, "lock": 2}, 0)


@pytest.mark.parametrize("name", ["wear.json", "calibration.json"])
def test_a_damaged_file_is_refused_rather_than_forgotten(store: Store, name: str) -> None:
    (store.folder / name).write_text("{")
    with pytest.raises(RobotRefused, match="damaged"):
        (store.wear if name == "wear.json" else store.calibration)()


@pytest.mark.parametrize("pose", [[0.0] * 16, [1.0] * 15])
def test_a_calibration_that_is_no_pose_is_refused(store: Store, pose: list[float]) -> None:
    shown = Calibration(
        o_t_lock=tuple(pose),
        spread_m=0,
        spread_rad=0,
        repeats=5,
        at="",
        tool=ToolTable(),
        seated_m=0.025,
    )
    store.set_calibration(shown)
    with pytest.raises(RobotRefused):
        store.calibration()


def test_a_diary_that_cannot_be_written_stops_nothing(store: Store) -> None:
    (store.folder / "diary.jsonl").mkdir()
    store.note("typed", word="stop")


def test_the_marker_of_the_key_stays_until_it_is_cleared(store: Store) -> None:
    assert not store.key_in_lock
    store.mark_key("a trial")
    store.mark_key("a trial")
    assert store.key_in_lock
    store.clear_key()
    store.clear_key()
    assert not store.key_in_lock


def test_only_so_many_logs_are_kept(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stores, "LOGS_MAX", 2)
    for number in range(4):
        store.keep_log(f"trial-{number}", np.zeros((1, 3)))
    assert len(list((store.folder / "logs").iterdir())) == 2


def test_a_result_is_kept_once_for_its_run_until_it_is_dropped(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    spool.put("run-1", result("token-0001"))
    spool.put("run-1", result("token-0001", trial=9))
    spool.put("run-2", result("token-0002"))
    assert Spool(tmp_path).pending("run-1") == [result("token-0001")]
    spool.drop("token-0001")
    spool.drop("token-0001")
    assert spool.pending("run-1") == []
    assert spool.pending("run-2") == [result("token-0002")]


def test_a_damaged_result_harms_no_other(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    spool.put("run-1", result("../../etc/token"))
    (tmp_path / "0.json").write_text("{")
    assert [kept.token for kept in spool.pending("run-1")] == ["../../etc/token"]
    assert {path.parent for path in tmp_path.rglob("*.json")} == {tmp_path}
