"""``shearline study``: bad input in one sentence, results for people and for programs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from shearline.deploy.cli import main, parser
from shearline.deploy.commands import study
from shearline.studies import repeat


def test_the_choices_of_figure_4_are_those_of_the_study() -> None:
    assert study.FUNCTIONS == repeat.FUNCTIONS
    assert tuple(repeat.Placement) == study.PLACEMENTS
    assert study.DIMENSIONS == repeat.DIMENSIONS


def test_figure_3_is_printed_for_programs_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["study", "fig3", "--experiments", "1", "--no-picture", "--out", str(tmp_path)]
    assert main([*asked, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [one["problem"] for one in data["problems"]] == ["as printed", "narrow"]
    assert [len(one["maxima"]) for one in data["problems"]] == [1, 2]
    assert data["pictures"] == []
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_figure_3_is_printed_for_people_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", "fig3", "--experiments", "2", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "of 2 seeds the region holds the maximum in 2 at the end" in said
    assert "both maxima" in said
    assert (tmp_path / "fig3.png").stat().st_size > 20_000


@pytest.mark.slow
def test_figure_4_prints_a_table_and_draws_what_was_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = [
        "study", "fig4", "--learners", "lhs", "--functions", "sphere", "--placements", "shifted",
        "--dimensions", "3", "--experiments", "2", "--workers", "1", "--out", str(tmp_path),
    ]  # fmt: skip
    assert main(asked) == 0
    said = capsys.readouterr().out
    assert "sphere, shifted: mean best cost" in said
    assert (tmp_path / "fig4-sphere.png").exists()
    assert main([*asked, "--json"]) == 0  # nothing is missing now
    data = json.loads(capsys.readouterr().out)
    assert [(one["learner"], one["runs"]) for one in data["curves"]] == [("lhs", 2)]


def test_a_study_of_an_unknown_learner_is_refused_before_anything_is_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["study", "fig4", "--learners", "nobody", "--out", str(out)]) == 2
    captured = capsys.readouterr()
    assert "psp" in captured.err
    assert len(captured.err.splitlines()) == 1
    assert not out.exists()


def test_a_plan_is_no_learner_to_compare(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", "fig4", "--learners", "plan", "--out", str(tmp_path / "out")]) == 2
    assert "plan" in capsys.readouterr().err


def test_a_study_without_anyone_to_run_it_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", "fig4", "--workers", "0", "--out", str(tmp_path / "out")]) == 2
    assert "--workers" in capsys.readouterr().err


def test_a_study_that_is_not_there_is_refused() -> None:
    with pytest.raises(SystemExit):
        parser().parse_args(["study", "functions"])
