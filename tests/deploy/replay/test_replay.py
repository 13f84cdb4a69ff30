"""``shearline replay``: what comes out, what is caught, what is refused."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from shearline.deploy.cli import main
from shearline.evaluator import keylock

Edit = Callable[[Any], Any]
Fields = Callable[..., Edit]
Tamper = Callable[[Path, str, Edit], Path]


@pytest.fixture(autouse=True)
def _no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


def said(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, list[Any], str]:
    """Run the command; return its exit code, its JSON lines and its last sentence of error."""
    try:
        code = main(["replay", *map(str, words)])
    except SystemExit as stopped:  # argparse
        code = int(stopped.code or 0)
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    rows = [json.loads(line) for line in captured.out.splitlines() if line.startswith("{")]
    return code, rows, captured.err.strip().rpartition("\n")[2]


def flip_last_byte(data: bytes) -> bytes:
    return data[:-4] + bytes([data[-4] ^ 1]) + data[-3:]


def test_a_recorded_trial_comes_out_again(
    keylock_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, (row,), _ = said(capsys, keylock_run, "--trial", 2, "--verify", "--json")
    assert code == 0
    assert row["trial"] == 2
    assert row["identical"] is True
    assert row["digest_recorded"] == row["digest_replayed"]
    assert len(row["digest_recorded"]) == 32


def test_every_trial_is_verified_and_a_last_line_counts_them(
    sphere_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = (sphere_run, "--all", "--verify", "--workers", 1)
    code, rows, _ = said(capsys, *words, "--json")
    assert code == 0
    assert [row["trial"] for row in rows[:-1]] == [0, 1, 2, 3]
    assert rows[-1] | {"wall_s": 0} == {
        "run": "small",
        "trials": 4,
        "identical": 4,
        "different": [],
        "left_out": {"lost": 1},
        "workers": 1,
        "wall_s": 0,
    }
    assert main(["replay", *map(str, words)]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("4 of 4 trials came out identical to the last bit (1 process,")
    assert last.endswith("left out: 1 lost")


def test_one_byte_of_a_trace_is_caught(
    keylock_run: Path,
    tampered: Tamper,
    with_fields: Fields,
    capsys: pytest.CaptureFixture[str],
) -> None:
    copy = tampered(keylock_run, "/trial/trace", with_fields(1, data=flip_last_byte))
    code, rows, _ = said(capsys, copy, "--all", "--verify", "--workers", 1, "--json")
    assert code == 4
    assert rows[-1]["different"] == [1]
    assert rows[1]["digest_recorded"] == rows[1]["digest_replayed"]
    assert "pin.5 is the first to differ, at" in rows[1]["why"]


def test_one_digit_of_a_parameter_is_caught(
    keylock_run: Path,
    tampered: Tamper,
    with_fields: Fields,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def nudge(theta: list[float]) -> list[float]:
        return [theta[0], math.nextafter(theta[1], 1.0), *theta[2:]]

    for topic in ("/trial/outcome", "/trial/proposed"):
        copy = tampered(keylock_run, topic, with_fields(3, theta=nudge))
        code, (row,), _ = said(capsys, copy, "--trial", 3, "--verify", "--json")
        assert code == 4
        assert "app_off_y was proposed as" in row["why"]
        copy.rename(copy.with_name(topic.rpartition("/")[2]))


def test_a_changed_digest_and_a_changed_cost_are_caught(
    keylock_run: Path,
    tampered: Tamper,
    with_fields: Fields,
    capsys: pytest.CaptureFixture[str],
) -> None:
    copy = tampered(keylock_run, "/trial/outcome", with_fields(0, digest="0" * 32, cost=0.25))
    code, (row,), _ = said(capsys, copy, "--trial", 0, "--verify", "--json")
    assert code == 4
    assert row["digest_recorded"] == "0" * 32
    assert "digest" in row["why"]


def test_trials_without_recorded_traces_are_verified_by_their_digests(
    keylock_run: Path,
    tampered: Tamper,
    with_fields: Fields,
    capsys: pytest.CaptureFixture[str],
) -> None:
    copy = tampered(keylock_run, "/trial/trace", lambda _: None)
    code, (row,), _ = said(capsys, copy, "--trial", 1, "--verify", "--json")
    assert code == 0
    assert row["identical"] is True
    copy.rename(copy.with_name("untraced"))
    changed = tampered(
        copy.with_name("untraced"), "/trial/outcome", with_fields(1, digest="0" * 32)
    )
    code, (row,), _ = said(capsys, changed, "--trial", 1, "--verify", "--json")
    assert code == 4
    assert "no trace is on record to say where" in row["why"]


def test_a_task_without_traces_is_verified_by_its_outcomes(
    sphere_run: Path,
    tampered: Tamper,
    with_fields: Fields,
    capsys: pytest.CaptureFixture[str],
) -> None:
    code, (row,), _ = said(capsys, sphere_run, "--trial", 0, "--verify", "--json")
    assert code == 0
    assert row["identical"] is True
    copy = tampered(sphere_run, "/trial/outcome", with_fields(0, cost=lambda c: c + 1e-9))
    code, (row,), _ = said(capsys, copy, "--trial", 0, "--verify", "--json")
    assert code == 4
    assert row["why"].startswith("the cost is")


def test_what_if_shows_the_outcome_beside_the_recorded_one(
    keylock_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = (keylock_run, "--trial", 0, "--with", "push=0", "xi=0.5", "--seed", 5)
    code, (row,), _ = said(capsys, *words, "--json")
    assert code == 0
    assert row["changed"] == {"ins_push": 0.0, "xi": 0.5}
    assert row["theta"]["ins_push"] == 0.0
    assert row["seed"] == 5
    assert row["identical"] is None
    assert row["recorded"]["digest"] != row["replayed"]["digest"]
    assert main(["replay", *map(str, words)]) == 0
    captured = capsys.readouterr()
    lines = captured.out.splitlines()
    assert lines[1].startswith("with ins_push 0 N instead of ")
    assert lines[3] == "with seed 5 instead of 1000"
    assert any(line.split()[0] == "cost" and len(line.split()) == 3 for line in lines[4:])
    assert "no screen here" in captured.err


def test_a_lost_trial_can_be_looked_at_but_not_verified(
    sphere_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, (row,), _ = said(capsys, sphere_run, "--trial", 4, "--json")
    assert code == 0
    assert row["recorded"] is None
    assert row["replayed"]["outcome"] == "success"
    code, _, error = said(capsys, sphere_run, "--trial", 4, "--verify")
    assert code == 2
    assert "nothing to verify" in error


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["--trial", "99"], "it has 5 trials, 0 to 4"),
        (["--trial", "-1"], ">= 0"),
        ([], "--trial --all is required"),
        (["--all"], "Add --verify"),
        (["--trial", "0", "--all"], "not allowed with"),
        (["--trial", "0", "--with", "x99=1"], "no parameter 'x99'"),
        (["--trial", "0", "--with", "x0=99"], "expected x0 from -5 to 5, got 99"),
        (["--trial", "0", "--with", "x0"], "NAME=VALUE"),
        (["--trial", "0", "--with", "x0=1", "--verify"], "cannot come out the same"),
        (["--trial", "0", "--seed", "1", "--verify"], "cannot come out the same"),
        (["--trial", "0", "--plant", "pybullet", "--verify"], "the plant that is on record"),
        (["--all", "--verify", "--save", "x.rrd"], "name it with --trial"),
        (["--trial", "0", "--workers", "2"], "add --all"),
        (["--trial", "0", "--video", "x.gif"], "end in .mp4"),
        (["--trial", "0", "--speed", "0"], "a speed from"),
        (["--trial", "0", "--task", "keylock"], "has the parameters x0"),
        (["--trial", "0", "--task", "nothing.py:f"], "nothing.py"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_sentence(
    sphere_run: Path, words: list[str], error: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, rows, sentence = said(capsys, sphere_run, *words)
    assert code == 2
    assert error in sentence
    assert not rows


def test_a_robot_s_trial_cannot_be_run_again(
    record: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = record(tmp_path / "run", "sphere", evaluator="franka-1", kind="robot")
    code, _, error = said(capsys, run, "--trial", 0, "--verify")
    assert code == 2
    assert "ran on the robot franka-1" in error
    code, _, error = said(capsys, run, "--all", "--verify")
    assert code == 2
    assert "can be verified: 4 run by a robot, 1 lost" in error


def test_a_truncated_record_is_replayed_up_to_where_it_ends(
    keylock_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "torn"
    run.mkdir()
    whole = (keylock_run / "record.mcap").read_bytes()
    (run / "record.mcap").write_bytes(whole[: len(whole) // 2])
    code, (row,), error = said(capsys, run, "--trial", 0, "--verify", "--json")
    assert code == 0
    assert row["identical"] is True
    assert error.startswith("shearline: record.mcap: ")
    code, _, error = said(capsys, run, "--trial", 3, "--verify")
    assert code == 2
    assert "no trial 3" in error
    assert "record.mcap: " in error


def test_a_folder_that_holds_no_record_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, error = said(capsys, tmp_path, "--trial", 0)
    assert code == 4
    assert "does not say what was learned" in error


OWN = """
from shearline.evaluator import task

@task(space={"x": ("m", -5.0, 5.0)})
def bowl(theta, rng):
    print("a task may print")
    return theta["x"] ** 2 + rng.normal(), True, {"noise": rng.normal()}
"""


def test_a_task_of_one_s_own_is_run_only_where_a_person_names_it(
    record: Callable[..., Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "my_replayed_bowl.py").write_text(OWN)
    run = record(tmp_path / "run", "my_replayed_bowl:bowl")
    code, _, error = said(capsys, run, "--trial", 0, "--verify")
    assert code == 2
    assert "name it with --task FILE:FUNCTION" in error
    words = (run, "--trial", 0, "--verify", "--task", "my_replayed_bowl.py:bowl", "--json")
    code, (row,), _ = said(capsys, *words)
    assert code == 0
    assert row["identical"] is True
    (tmp_path / "my_replayed_bowl.py").write_text(OWN.replace("** 2", "** 2 + 1"))
    monkeypatch.delitem(sys.modules, "my_replayed_bowl")
    code, (row,), _ = said(capsys, *words)
    assert code == 4
    assert "the engine is not the same: python 3" in row["why"]


def test_without_the_simulator_one_sentence_says_what_to_install(
    keylock_run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing(_: object) -> None:
        raise ModuleNotFoundError(name="mujoco")

    monkeypatch.setattr(keylock.KeylockTask, "plant", property(missing))
    code, _, error = said(capsys, keylock_run, "--trial", 0)
    assert code == 2
    assert "task keylock needs mujoco" in error


@pytest.mark.slow
def test_many_processes_find_what_one_finds(
    keylock_run: Path, tampered: Tamper, with_fields: Fields
) -> None:
    copy = tampered(keylock_run, "/trial/trace", with_fields(2, data=flip_last_byte))
    done = subprocess.run(
        [sys.executable, "-m", "shearline.deploy", "replay", copy, "--all", "--verify",
         "--workers", "2", "--json"],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 4, done.stderr
    assert [row["identical"] for row in rows[:-1]] == [True, True, False, True]
    assert rows[-1]["workers"] == 2
