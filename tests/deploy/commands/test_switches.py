"""``shearline study switches``: a row for each variant, for people and for programs."""

from __future__ import annotations

import json

import pytest

from shearline.deploy.cli import main
from shearline.deploy.commands import switches
from shearline.studies import switches as tables


def test_the_choices_are_those_of_the_study() -> None:
    assert tuple(tables.TABLES) == switches.TABLES


@pytest.fixture
def _two_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the table to what a quick test can run in full length."""
    rows = {"ga": tables.RIVALS["ga"], "pso": tables.RIVALS["pso"]}
    monkeypatch.setattr(tables, "TABLES", {"rivals": rows})


@pytest.mark.usefixtures("_two_rows")
def test_programs_get_every_row(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["study", "switches", "rivals", "--experiments", "2", "--json"]
    assert main([*asked, "--problems", "sphere", "ridge"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [(row["learner"], row["problem"]) for row in rows] == [
        ("ga", "sphere, shifted"),
        ("pso", "sphere, shifted"),
        ("ga", "fragile ridge"),
        ("pso", "fragile ridge"),
    ]
    assert all(row["runs"] == 2 for row in rows)


@pytest.mark.usefixtures("_two_rows")
def test_people_read_cost_or_success_with_its_error(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["study", "switches", "rivals", "--experiments", "2"]
    assert main([*asked, "--problems", "sphere", "ridge"]) == 0
    first, *_, last = capsys.readouterr().out.splitlines()
    assert "best" in first
    assert "% succeed late" in last
    assert all("+-" in line for line in (first, last))
