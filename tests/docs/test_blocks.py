"""Every command block in the README and the docs does what it says.

Blocks of one page run in order in one new folder, as a reader would type them. What a reader
would do on several machines happens on this one: ``LEARNER`` is this machine, the usual port is a
free one, and a learner or evaluator that would hold its terminal runs in the background.
"""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from shearline.protocol.endpoints import free_endpoint

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
HOLDS_TERMINAL = re.compile(r"^(shearline (?:learner|evaluator) [^&\n]*[^&\s])\s*$", re.MULTILINE)
#: What a reader types at a robot's terminal; the terminal stays open behind it.
AT_THE_ROBOT = re.compile(r"^(shearline evaluator [^&|\n]*--robot [^&|\n]*)$", re.MULTILINE)
TYPED = "< <(echo confirm; exec sleep 60 2>/dev/null)"
PATIENCE_S = 120
#: Pages whose Python needs more around it than a folder, and the tests that run it.
PYTHON_ELSEWHERE = {
    "protocol": ROOT / "tests" / "protocol" / "test_docs.py",
    "record": ROOT / "tests" / "record" / "test_docs.py",
}


def blocks(page: Path) -> list[tuple[str, str]]:
    return [(match[1], match[2]) for match in BLOCK.finditer(page.read_text())]


def script(text: str, port: str) -> str:
    text = text.replace("LEARNER", "127.0.0.1").replace("7447", port)
    text = AT_THE_ROBOT.sub(rf"\1 {TYPED}", text)
    return "set -e\n" + HOLDS_TERMINAL.sub(r"\1 &", text) + "\nwait\n"


def run(command: list[str], folder: Path) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    # A page's last learner may outlive a failing command: end the whole session.
    process = subprocess.Popen(
        command,
        cwd=folder,
        env=os.environ | {"PATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        said, _ = process.communicate(timeout=PATIENCE_S)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == 0, said
    assert "Traceback" not in said


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_work_as_written(page: Path, tmp_path: Path) -> None:
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    port = free_endpoint().rsplit(":", 1)[1]
    for language, text in blocks(page):
        match language:
            case "sh" if not text.startswith("make "):
                run(["bash", "-c", script(text, port)], tmp_path)
            case "python" if page.stem in PYTHON_ELSEWHERE:
                assert PYTHON_ELSEWHERE[page.stem].exists()
            case "python":
                (tmp_path / "block.py").write_text(text)
                run([sys.executable, "block.py"], tmp_path)
            case "toml":
                (tmp_path / "run.toml").write_text(text)


def test_the_two_commands_of_the_readme_are_there() -> None:
    make = shutil.which("make")
    assert make
    for target in ("demo", "test"):
        assert f"make {target}" in (ROOT / "README.md").read_text()
        done = subprocess.run(
            [make, "-n", target], cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr


def test_continuous_integration_runs_exactly_what_a_person_runs() -> None:
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert lines[-1] == "exec make test"
    said = [line for line in lines if not line.startswith("#")]
    assert [line for line in said if re.search(r"\b(make|pytest|python|ruff|mypy)\b", line)] == [
        "exec make test"
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#\s]+)(?:#[^)]*)?\)", page.read_text())
    missing = [link for link in links if not (page.parent / link).exists()]
    assert not missing


def test_no_page_names_a_place_that_only_its_author_has() -> None:
    for page in PAGES:
        assert not re.search(r"/(work|home|root|tmp)/\w", page.read_text()), page
