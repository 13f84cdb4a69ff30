"""The page as a whole: complete, alone, and as small as it was promised."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from shearline.protocol.errors import RecordError
from shearline.record.report import compare, report, write

See = Callable[..., Any]
SECTIONS = ("Learning", "Result", "Search", "Trials", "Machinery", "Again")
BYTES_MAX = 5_000_000


def test_a_page_is_whole_and_has_all_its_sections(whole: Path, see: See) -> None:
    text = report(whole)
    page = see(text)
    assert text.startswith("<!doctype html>")
    headings = [heading for heading in SECTIONS if heading in page.text]
    assert headings == list(SECTIONS)
    assert page.count("card") == 12


def test_a_page_refers_to_nothing_outside_itself(whole: Path, see: See) -> None:
    text = report(whole)
    page = see(text)
    for element, attributes in page.elements:
        assert not {"src", "href", "srcset", "data", "action"} & set(attributes), element
    assert "url(" not in text
    assert "@import" not in text
    (policy,) = (a["content"] for _, a in page.elements if "http-equiv" in a)
    assert str(policy).startswith("default-src 'none';")


def test_the_same_record_gives_the_same_page(whole: Path) -> None:
    assert report(whole) == report(whole)


def test_every_picture_says_what_it_shows_to_those_who_cannot_see_it(whole: Path, see: See) -> None:
    for element, attributes in see(report(whole)).elements:
        if element == "svg":
            assert attributes.get("aria-label") or attributes.get("aria-hidden")


def test_what_a_task_says_cannot_become_part_of_the_page(whole: Path, see: See) -> None:
    assert "<stopped>" not in report(whole)
    assert "the engine <stopped>" in see(report(whole)).text


def test_an_empty_folder_has_a_page_too(tmp_path: Path, see: See) -> None:
    assert "not ended" in see(report(tmp_path)).text


def test_a_torn_record_is_read_up_to_the_damage_and_the_page_says_so(whole: Path, see: See) -> None:
    record = whole / "record.mcap"
    record.write_bytes(record.read_bytes()[: record.stat().st_size * 2 // 3])
    page = see(report(whole))
    assert page.text.count("The record is damaged.") == 1
    assert re.search(r"record\.mcap: it breaks off at byte \d+; all else before", page.text)
    assert page.count("strand") > 0


def test_a_comparison_shows_every_run_and_what_differs(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, see: See
) -> None:
    other = tmp_path_factory.mktemp("other")
    for path in whole.iterdir():
        (other / path.name).write_bytes(path.read_bytes())
    text = (other / "run.toml").read_text().replace("seed = 0", "seed = 1")
    (other / "run.toml").write_text(text)
    page = see(compare([whole, other]))
    assert "2 runs compared" in page.text
    for path in (whole, other):
        assert f"synthetic ({path})" in page.text, "runs of one name are told apart by folder"
    assert page.count("r0") == page.count("r1") > 5
    assert "Recommended tuples" in page.text


def test_runs_of_different_spaces_are_compared_as_far_as_they_can_be(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, see: See
) -> None:
    page = see(compare([whole, tmp_path_factory.mktemp("empty")]))
    assert "These runs differ in their parameters." in page.text
    assert "seed" in page.text


def test_a_report_is_written_beside_its_run_and_a_comparison_here(
    whole: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path_factory.mktemp("here"))
    assert write([whole]) == whole / "report.html"
    assert write([whole / "record.mcap"]) == whole / "report.html"
    assert write([whole, whole]) == Path("comparison.html")
    assert Path("comparison.html").read_text() == compare([whole, whole])
    assert [path.name for path in whole.glob("*.html")] == ["report.html"]


def test_a_file_that_cannot_be_written_is_one_clear_error(whole: Path) -> None:
    with pytest.raises(RecordError, match=r"cannot write .*report\.html: .*: choose another file"):
        write([whole], whole / "nowhere" / "report.html")


@pytest.mark.slow
def test_two_thousand_trials_make_a_page_below_five_megabytes(
    write_run: Callable[..., Path], see: See
) -> None:
    text = report(write_run(episodes=100, per_episode=20, hz=10))
    assert 300_000 < len(text.encode()) < BYTES_MAX
    page = see(text)
    assert "Every trial (2000)" in page.text
    assert page.count("strand") == 400
