"""The page about the dispatcher shows the tables that the program uses."""

from __future__ import annotations

from pathlib import Path

import pytest

from shearline.learner.dispatcher.diagram import TABLES, main, mermaid

PAGE = Path(__file__).resolve().parents[3] / "docs" / "dispatcher.md"


@pytest.mark.parametrize("name", TABLES)
def test_the_page_shows_the_table_that_the_program_uses(name: str) -> None:
    assert f"```mermaid\n{mermaid(TABLES[name])}\n```" in PAGE.read_text()


@pytest.mark.parametrize("name", TABLES)
def test_the_page_says_what_every_state_means(name: str) -> None:
    text = PAGE.read_text()
    assert all(f"**{state}**" in text for state in TABLES[name])


def test_a_diagram_has_an_arrow_for_every_transition() -> None:
    table = {"a": {"x": "b", "y": "b", "z": "a"}, "b": {}}
    assert mermaid(table).splitlines() == [
        "stateDiagram-v2",
        "    [*] --> a",
        "    a --> b: x, y",
        "    a --> a: z",
        "    b --> [*]",
    ]


def test_the_command_prints_all_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    main()
    printed = capsys.readouterr().out
    assert all(f"%% {name}\n{mermaid(table)}" in printed for name, table in TABLES.items())
