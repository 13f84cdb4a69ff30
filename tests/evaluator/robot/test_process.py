"""The arm's process as a person starts it: every refusal is one sentence, and nothing moves."""

from __future__ import annotations

import io
import os
import sys
import time
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import msgspec
import numpy as np
import pytest
from evaluator.robot.cell import calibrate
from evaluator.robot.rig import EXAMPLES, O_T_LOCK, attempt, bounds, stage, typed

from shearline.evaluator.robot import pipe, process
from shearline.evaluator.robot.bounds import read_bounds
from shearline.evaluator.robot.errors import RobotRefused
from shearline.evaluator.robot.load import load_port
from shearline.evaluator.robot.local import calibrate as by_hand
from shearline.evaluator.robot.local import dry_run, hover
from shearline.evaluator.robot.peer import Gone, Peer
from shearline.evaluator.robot.port import Mode
from shearline.evaluator.robot.process import Orders, listen, main, run
from shearline.evaluator.robot.results import Task
from shearline.evaluator.robot.store import Store
from shearline.evaluator.robot.task import RobotTask
from shearline.evaluator.robot.terminal import Closed, Terminal
from shearline.protocol.errors import ConfigError

STAGE = f"{EXAMPLES / 'stage.py'}:Stage"


def orders(folder: Path, **changes: Any) -> Orders:
    """Return what a person types for the stage in a folder, the lock shown."""
    path = folder / "stage.toml"
    if not path.exists():
        path.write_text((EXAMPLES / "stage.toml").read_text())
        calibrate(folder / "stage.state", O_T_LOCK, read_bounds(path))
    return Orders(**({"robot": STAGE, "bounds": str(path), "mode": "dry-run"} | changes))


def terminal() -> tuple[Terminal, io.StringIO, SimpleQueue[Any]]:
    heard, inbox = io.StringIO(), SimpleQueue[Any]()
    return Terminal(inbox, lambda: None, io.StringIO(), heard), heard, inbox


# -- refusals --------------------------------------------------------------------------------------


def test_a_dry_run_ends_well_and_says_what_it_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    over = run(orders(tmp_path))
    assert (over.code, over.why) == (0, "dry run: nothing has moved")
    said = capsys.readouterr().err
    assert "0.0 mm and 0.0 deg off the start pose" in said
    assert "peg-1: 0 of 5000 insertions" in said


def test_a_bad_bounds_file_is_refused(tmp_path: Path) -> None:
    asked = orders(tmp_path)
    Path(asked.bounds).write_text("[guard]")
    over = run(asked)
    assert over.code == 2
    assert "missing required field" in over.why


def test_a_bounds_file_that_is_not_there_is_refused_and_nothing_is_made(tmp_path: Path) -> None:
    missing = tmp_path / "labs" / "typo.toml"
    missing.parent.mkdir()
    with pytest.raises(ConfigError, match="there is no bounds file"):
        RobotTask(orders(tmp_path, bounds=str(missing)))
    assert list(missing.parent.iterdir()) == []


def test_no_calibration_is_refused(tmp_path: Path) -> None:
    asked = orders(tmp_path)
    (tmp_path / "stage.state" / "calibration.json").unlink()
    over = run(asked)
    assert over.code == 4
    assert "--calibrate" in over.why


@pytest.mark.parametrize("changed", ["[tool]\nmass_kg = 1.0\n", "[lock]\nseated_m = 0.02\n"])
def test_a_lock_shown_with_another_tool_or_depth_is_refused(tmp_path: Path, changed: str) -> None:
    asked = orders(tmp_path)
    text = Path(asked.bounds).read_text()
    Path(asked.bounds).write_text(text + changed)
    over = run(asked)
    assert over.code == 4
    assert "the lock was shown with another tool" in over.why


def test_a_mistake_of_the_program_is_told_to_the_worker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def mistaken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(process, "load_port", mistaken)
    over = run(orders(tmp_path))
    assert (over.code, over.why) == (4, "the arm's process failed: ZeroDivisionError()")
    assert "Traceback" in caplog.text


def test_bounds_for_another_number_of_joints_are_refused(tmp_path: Path) -> None:
    asked = orders(tmp_path)
    text = Path(asked.bounds).read_text()
    Path(asked.bounds).write_text(text.replace("[55.0, 55.0, 55.0]", "[55.0]"))
    over = run(asked)
    assert over.code == 2
    assert "3 joints" in over.why


def test_a_robot_whose_folder_is_in_use_is_refused(tmp_path: Path) -> None:
    asked = orders(tmp_path)
    held = Store(tmp_path / "stage.state")
    assert "another process" in run(asked).why
    held.close()


def test_a_start_pose_outside_the_workspace_is_refused(tmp_path: Path) -> None:
    asked = orders(tmp_path)
    text = Path(asked.bounds).read_text()
    Path(asked.bounds).write_text(text.replace("[0.4, 0.1, 0.3]", "[0.4, 0.1, 0.11]"))
    over = run(asked)
    assert over.code == 4
    assert "outside the lab's workspace" in over.why


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("kuka", "no robot 'kuka'"),
        ("kuka:", "no robot 'kuka:'"),
        (":Kuka", "no robot ':Kuka'"),
        ("kuka:Kuka", "no file kuka.py in .* and no module 'kuka'"),
        (f"{EXAMPLES / 'none.py'}:Stage", "no file"),
        (f"{EXAMPLES / 'stage.py'}:Stag", "no class 'Stag'"),
    ],
)
def test_a_robot_that_nobody_can_find_is_refused_with_the_names_of_those_there_are(
    name: str, why: str
) -> None:
    with pytest.raises(
        ConfigError, match=f"{why}.*: expected franka, panda or MODULE:CLASS"
    ) as refused:
        load_port(name)
    assert "keylock" not in str(refused.value), "tasks are no robots"
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        (f"{EXAMPLES / 'stage.py'}:Slide", "cannot be made"),
        ("queue:SimpleQueue", "it lacks joints, engine"),
    ],
)
def test_a_class_that_is_no_robot_is_refused(name: str, why: str) -> None:
    with pytest.raises(ConfigError, match=why):
        load_port(name)


def test_a_client_library_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "shearline.evaluator.robot.franky", None)
    with pytest.raises(ConfigError, match="install franky-control"):
        load_port("franka")


def test_the_process_says_its_end_where_nobody_else_will(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([msgspec.json.encode(orders(tmp_path)).decode()]) == 0
    assert "shearline: dry run" in capsys.readouterr().err


# -- without a learner -----------------------------------------------------------------------------


def test_hovering_moves_away_from_the_lock_and_never_touches_it(store: Store) -> None:
    screen, _, inbox = terminal()
    port = stage()
    inbox.put(typed("confirm"))
    over = hover(port, bounds(), Task(), screen, inbox, O_T_LOCK)
    assert "it counts for nothing" in over.why
    height = port.drain_log()[:, 13 + 11]
    assert height.min() > 0.1 + 0.01
    assert not store.key_in_lock


@pytest.mark.parametrize("word", ["no", "", None])
def test_hovering_needs_a_confirmation(word: str | None) -> None:
    screen, _, inbox = terminal()
    inbox.put(Closed() if word is None else typed(word))
    port = stage()
    assert "nothing has moved" in hover(port, bounds(), Task(), screen, inbox, O_T_LOCK).why
    assert len(port.drain_log()) == 0


def test_hovering_with_the_key_in_the_lock_is_refused() -> None:
    screen, _, inbox = terminal()
    inbox.put(typed("confirm"))
    with pytest.raises(RobotRefused, match="free the key first"):
        hover(stage("hand"), bounds(), Task(), screen, inbox, O_T_LOCK)


def test_the_lock_is_shown_by_hand_and_found_where_it_is(store: Store) -> None:
    screen, heard, inbox = terminal()
    for word in ("what", *["here"] * 5):
        inbox.put(typed(word))
    over = by_hand(stage("hand"), bounds(), store, screen, inbox)
    assert "5 repeats within" in over.why
    found = store.calibration()
    assert found is not None
    assert np.abs(found.pose() - O_T_LOCK).max() < 1e-4
    assert "repeat 5 of 5" in heard.getvalue()


def test_a_calibration_that_is_given_up_leaves_the_one_before(store: Store) -> None:
    screen, _, inbox = terminal()
    inbox.put(typed("here"))
    inbox.put(Closed())
    with pytest.raises(RobotRefused, match="given up"):
        by_hand(stage("hand"), bounds(), store, screen, inbox)
    assert store.calibration() is None


@pytest.mark.parametrize(
    ("lie", "why"),
    [
        ({"dq": np.ones(3)}, "still moves"),
        ({"o_t_ee": np.full((4, 4), np.nan)}, "no pose: nothing was taken"),
    ],
)
def test_an_arm_that_moves_or_lies_shows_nothing(
    store: Store, lie: dict[str, Any], why: str
) -> None:
    screen, heard, inbox = terminal()
    port = stage("hand")
    true = port.sample
    port.sample = lambda: true()._replace(**lie)
    inbox.put(typed("here"))
    inbox.put(typed("quit"))
    with pytest.raises(RobotRefused):
        by_hand(port, bounds(), store, screen, inbox)
    assert why in heard.getvalue()


def test_a_dry_run_tells_of_a_key_in_the_lock(store: Store) -> None:
    screen, heard, _ = terminal()
    store.mark_key("kill -9")
    dry_run(stage(), bounds(), store, screen, O_T_LOCK)
    assert "the key may be in the lock" in heard.getvalue()


# -- the terminal and the pipe ---------------------------------------------------------------------


def test_the_word_stop_is_acted_upon_by_the_thread_that_reads_it() -> None:
    stops: list[bool] = []
    inbox: SimpleQueue[Any] = SimpleQueue()
    screen = Terminal(inbox, lambda: stops.append(True), io.StringIO(" STOP \nconfirm\n"))
    screen.start()
    stop, confirm, end = (inbox.get(timeout=5.0) for _ in range(3))
    assert (stop.text, confirm.text, end) == ("stop", "confirm", Closed())
    assert stop.at_s <= confirm.at_s <= time.monotonic()
    assert stops == [True]


def test_a_screen_that_is_gone_does_no_harm() -> None:
    screen, heard, _ = terminal()
    heard.close()
    screen.say("anything")


def pipes() -> tuple[pipe.Pipe, pipe.Pipe]:
    (a, b), (c, d) = os.pipe(), os.pipe()
    return pipe.Pipe(a, d), pipe.Pipe(c, b)


def test_what_the_worker_says_is_noted_at_once_or_waits_its_turn() -> None:
    ours, theirs = pipes()
    inbox, peer = SimpleQueue[Any](), Peer()
    for message in (
        pipe.Look(linked=False, held=True),
        attempt(3),
        pipe.Leave(why="bye"),
    ):
        theirs.send(message)
    theirs.close()
    listen(ours, inbox, peer)
    assert (peer.linked, peer.held, peer.halt_why, peer.leaving) == (False, True, "", "bye")
    items = [inbox.get_nowait() for _ in range(3)]
    assert items[:2] == [attempt(3), pipe.Leave(why="bye")]
    assert isinstance(items[2], Gone)
    ours.close()


def test_a_stop_is_for_one_attempt_and_no_other_revokes_it() -> None:
    ours, theirs = pipes()
    peer = Peer()
    before, other = attempt(3), attempt(4)
    theirs.send(before)
    theirs.send(pipe.Stop(token=before.trial.token, why="stop it"))
    theirs.send(other)
    theirs.close()
    listen(ours, SimpleQueue[Any](), peer)
    peer.running = before.trial.token
    assert peer.halt_why == "stop it"
    peer.running = other.trial.token
    assert peer.halt_why == ""
    ours.close()


@pytest.mark.parametrize(
    "data", [b"\x00\x00\x00\x03abc", b"\xff\xff\xff\xff", b"\x00\x00", b"\x00\x00\x00\x01\xc0"]
)
def test_what_is_no_message_counts_as_the_end_of_the_worker(data: bytes) -> None:
    reads, writes = os.pipe()
    os.write(writes, data)
    os.close(writes)
    inbox: SimpleQueue[Any] = SimpleQueue()
    listen(pipe.Pipe(reads, reads), inbox, Peer())
    assert isinstance(inbox.get_nowait(), Gone)
    os.close(reads)


def test_an_outbox_gives_signs_of_life_only_while_the_arm_does() -> None:
    ours, theirs = pipes()
    outbox = process.Outbox(ours)
    first = theirs.receive(5.0)
    assert first is not None
    assert msgspec.msgpack.decode(first, type=pipe.FromArm) == pipe.Pulse()
    outbox.put(pipe.Over(code=0, why="done"))
    outbox.wait(5.0)
    ours.close()
    theirs.close()


def test_the_robots_mode_is_said_when_it_is_not_idle(tmp_path: Path) -> None:
    screen, heard, _ = terminal()
    port = stage()
    true = port.sample
    port.sample = lambda: true()._replace(mode=Mode.GUIDING)
    held = Store(tmp_path / "s")
    dry_run(port, bounds(), held, screen, O_T_LOCK)
    held.close()
    assert "the robot is guiding" in heard.getvalue()
