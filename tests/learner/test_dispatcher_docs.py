"""The page about the dispatcher shows the tables that the program uses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from shearline.learner.dispatcher.states import ATTEMPT, RUN, TRIAL, Table

PAGE = Path(__file__).resolve().parents[2] / "docs" / "dispatcher.md"


def render(table: Table[Any, Any]) -> str:
    """Return a table as Markdown, one row for each state."""
    rows = [
        f"| **{state}** | {', '.join(f'{c} → {s}' for c, s in row.items()) or 'nothing'} |"
        for state, row in table.items()
    ]
    return "\n".join(["| state | what leads where |", "| --- | --- |", *rows])


@pytest.mark.parametrize("table", [RUN, TRIAL, ATTEMPT], ids=["RUN", "TRIAL", "ATTEMPT"])
def test_the_page_shows_the_table_that_the_program_uses(table: Table[Any, Any]) -> None:
    assert render(table) in PAGE.read_text()
