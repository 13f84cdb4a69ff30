"""Bad input ends in one sentence and the right exit code, before anything is started."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from shearline.deploy.cli import main, parser
from shearline.deploy.options import run_arguments

BROKEN = {
    "syntax.py": "def oops(:\n",
    "plain.py": "def f(theta, rng):\n    return 1.0, True\n",
    "bounds.py": (
        "from shearline.evaluator import task\n"
        "@task(space={'x': ('m', 1.0, -1.0)})\n"
        "def f(theta, rng):\n    return 1.0, True\n"
    ),
    "missing.py": "import no_such_module_anywhere\n",
    "bad.toml": "task = [\n",
    "unknown.toml": "task = 'sphere'\ncolour = 3\n",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in BROKEN.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    return tmp_path


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Run a command that must fail at once; return its exit code and its one sentence."""
    try:
        code = main(arguments)
    except SystemExit as stopped:  # argparse
        code = int(stopped.code or 0)
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    assert not captured.out
    return code, captured.err.strip()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "--task"),
        (["--task", "keylok"], "keylock"),
        (["--task", "nowhere.py:f"], "nowhere.py"),
        (["--task", "syntax.py:oops"], "line 1"),
        (["--task", "plain.py:f"], "@task"),
        (["--task", "plain.py:g"], "g"),
        (["--task", "bounds.py:f"], "low < high"),
        (["--task", "missing.py:f"], "no_such_module_anywhere"),
        (["--task", "sphere", "--learner", "pso2"], "psp"),
        (["--task", "sphere", "--episodes", "0"], ">= 1"),
        (["--task", "sphere", "--trials", "many"], ">= 1"),
        (["--task", "sphere", "--lease", "-1"], "seconds"),
        (["nothing.toml"], "nothing.toml"),
        (["bad.toml"], "TOML"),
        (["unknown.toml"], "colour"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_a_run_that_cannot_be_run_is_refused_in_one_sentence(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, error = refused(["up", "--out", "out", *arguments], capsys)
    assert code == 2
    assert said in error.splitlines()[-1]
    assert not Path("out").exists()


@pytest.mark.usefixtures("folder")
def test_a_malformed_endpoint_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    code, error = refused(["up", "--task", "sphere", "--listen", "tcp:7447"], capsys)
    assert code == 3
    assert "tcp/" in error


@pytest.mark.parametrize(
    "command",
    [
        ["evaluator"],
        ["status"],
        ["stop"],
    ],
    ids=lambda command: command[0],
)
def test_no_learner_there_is_exit_code_3(command: list[str]) -> None:
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))  # bound, not listening: refuses
        endpoint = f"tcp/127.0.0.1:{nobody.getsockname()[1]}"
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "shearline.deploy",
                *command,
                "--connect",
                endpoint,
                "--patience",
                "0.2",
            ],
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )
    assert done.returncode == 3
    assert "nobody answers" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.usefixtures("folder")
def test_a_taken_endpoint_is_exit_code_3(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        code, error = refused(
            ["learner", "--task", "sphere", "--listen", endpoint, "--out", "out"], capsys
        )
    assert code == 3
    assert "taken" in error


def test_a_run_folder_that_is_not_there_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, error = refused(["trials", str(tmp_path / "none")], capsys)
    assert code == 4
    assert "run folder" in error


def test_a_reader_that_leaves_early_is_no_error(tmp_path: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w") as pipe:
        done = subprocess.run(
            [sys.executable, "-m", "shearline.deploy", "doctor", "--json"],
            stdout=pipe,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            timeout=120,
            check=False,
        )
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr


def test_what_was_typed_reaches_the_child_unchanged() -> None:
    typed = [
        "run.toml", "--task", "a:b", "--learner", "lhs", "--episodes", "3", "--trials", "4",
        "--seed", "5", "--lease", "1.5", "--no-record",
    ]  # fmt: skip
    first = parser().parse_args(["up", *typed])
    again = parser().parse_args(["learner", *run_arguments(first)])
    for name in ("config", "task", "learner", "episodes", "trials", "seed", "lease", "no_record"):
        assert getattr(again, name) == getattr(first, name), name
