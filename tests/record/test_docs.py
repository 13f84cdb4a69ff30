"""The page about the record tells the truth: its snippets run, its table of topics is complete."""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from shearline.record.topics import STANDARD, TOPICS

PAGE = (Path(__file__).parents[2] / "docs" / "record.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)


@pytest.mark.parametrize("snippet", SNIPPETS, ids=["columns", "rows", "plain"])
def test_a_snippet_runs_as_it_stands(
    snippet: str, write_run: Callable[..., Path], tmp_path: Path
) -> None:
    run_dir = write_run()
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", snippet.replace('"RUN', f'"{run_dir}')],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "success" in done.stdout
    assert "insertion" in done.stdout or "depth" in done.stdout


def test_every_topic_stands_in_the_table() -> None:
    for topic in (*TOPICS.values(), *STANDARD):
        assert f"| `{topic.name}` | `{topic.schema}` |" in PAGE


def test_the_picture_is_there() -> None:
    picture = Path(__file__).parents[2] / "docs" / "images" / "view.png"
    assert 50_000 < picture.stat().st_size < 300_000
