"""The page about the report tells the truth."""

import re
from pathlib import Path

from shearline.record.report import report

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "report.md").read_text(encoding="utf-8")


def test_every_picture_of_the_page_stands_in_the_table(whole: Path) -> None:
    rows = re.findall(r"^\| ([^|]+?) \|", PAGE, flags=re.MULTILINE)[2:]
    titles = [*re.findall(r"<h3>([^<]*)</h3>", report(whole)), "Every trial"]
    assert sorted(rows) == sorted(title[0].lower() + title[1:] for title in titles)


def test_the_picture_is_there_and_small_enough_for_a_page() -> None:
    assert 50_000 < (DOCS / "images" / "report.png").stat().st_size < 300_000
