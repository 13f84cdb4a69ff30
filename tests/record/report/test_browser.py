"""A report in a real browser: on a desk, on a phone, in the dark, on paper, without script."""

import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from shearline.protocol.errors import RecordError
from shearline.record.report import screenshot, write
from shearline.record.report.browser import Browser, Page, browser, executable

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        executable() is None,
        reason="the report is looked at in Chromium, and there is none here (Debian: chromium)",
    ),
]

PHONE_PX = 390
#: Elements that reach beyond their card or the window, other than in what scrolls on its own.
BEYOND = """
[...document.querySelectorAll('body *')].filter(e => !e.closest('.scroll, pre, svg, .tip'))
  .filter(e => e.getBoundingClientRect().right
    > (e.parentElement.closest('.card')?.getBoundingClientRect().right ?? innerWidth))
  .map(e => `${e.tagName}.${e.className} ${e.textContent.slice(0, 40)}`)
"""


@pytest.fixture(scope="module")
def started() -> Iterator[Browser]:
    with browser() as running:
        yield running


@pytest.fixture
def chromium(started: Browser) -> Iterator[Browser]:
    yield started
    started.close_pages()


@pytest.fixture
def page_path(whole: Path) -> Path:
    return write([whole])


def pixels(png: bytes) -> np.ndarray:
    """Decode a picture ``(rows, columns, 3)``, 0 to 1."""
    return np.asarray(imread(io.BytesIO(png)), dtype=np.float64)[:, :, :3]


def quiet(page: Page, path: Path) -> bool:
    """Tell that nothing went wrong, and that the page asked for itself and nothing else."""
    assert page.errors == []
    assert page.requests == [path.as_uri()]
    return True


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_a_page_is_drawn_without_an_error_or_a_request(
    chromium: Browser, page_path: Path, *, dark: bool
) -> None:
    page = chromium.open(page_path, dark=dark)
    assert quiet(page, page_path)
    seen = pixels(page.screenshot(full=True))
    assert seen.shape[0] > 2000, "the whole page, not the window"
    assert seen.shape[1] == 1280
    paper = np.median(seen.reshape(-1, 3), axis=0)
    assert (paper.mean() < 0.3) == dark
    drawn = np.abs(seen - paper).max(axis=2) > 0.2
    assert 0.02 < drawn.mean() < 0.6
    rows = drawn.any(axis=1)
    longest = max(len(run) for run in "".join("x" if r else "." for r in rows).split("x"))
    assert longest < 300, "no screen of it is empty"


def test_every_picture_has_ink_in_its_plane(chromium: Browser, page_path: Path) -> None:
    page = chromium.open(page_path)
    seen = pixels(page.screenshot(full=True))
    boxes = page.evaluate(
        "[...document.querySelectorAll('.plot svg, .strands, .lane')].map(e => {"
        "const r = e.getBoundingClientRect();"
        "return [r.left, r.top + scrollY, r.right, r.bottom + scrollY].map(Math.round)})"
    )
    assert len(boxes) > 10
    for left, top, right, bottom in boxes:
        box = seen[top:bottom, left:right].reshape(-1, 3)
        assert len(np.unique(np.round(box, 1), axis=0)) > 3, (left, top)


def test_a_phone_shows_all_of_it_without_scrolling_sideways(
    chromium: Browser, page_path: Path
) -> None:
    page = chromium.open(page_path, width_px=PHONE_PX, height_px=844)
    assert quiet(page, page_path)
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE_PX
    assert page.evaluate(BEYOND) == []
    smallest = page.evaluate(
        "Math.min(...[...document.querySelectorAll('body *')].filter(e => e.textContent.trim()"
        " && !e.children.length && !e.closest('svg, script')).map(e =>"
        " parseFloat(getComputedStyle(e).fontSize)))"
    )
    assert smallest >= 11.0, "CSS pixels; smaller cannot be read on a phone"


def test_a_phone_shows_a_comparison_too(chromium: Browser, whole: Path, tmp_path: Path) -> None:
    path = write([whole, whole], tmp_path / "comparison.html")
    page = chromium.open(path, width_px=PHONE_PX, height_px=844)
    assert quiet(page, path)
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE_PX
    assert page.evaluate(BEYOND) == []


def test_it_prints_on_a_few_sheets_of_paper(chromium: Browser, page_path: Path) -> None:
    printed = chromium.open(page_path, dark=True).pdf()
    assert printed.startswith(b"%PDF")
    assert 2 <= len(re.findall(rb"/Type /Page\b", printed)) <= 8


def test_without_script_it_looks_the_same(chromium: Browser, page_path: Path) -> None:
    with_script = chromium.open(page_path).screenshot(full=True)
    without = chromium.open(page_path, script=False).screenshot(full=True)
    assert np.array_equal(pixels(with_script), pixels(without))


def test_a_mark_says_what_it_is_under_the_cursor(chromium: Browser, page_path: Path) -> None:
    page = chromium.open(page_path)
    where = "document.querySelector('.dot.ok.big').getBoundingClientRect()"
    box = page.evaluate(f"(r => [r.left + r.width / 2, r.top + r.height / 2])({where})")
    page.ask("Input.dispatchMouseEvent", type="mouseMoved", x=box[0], y=box[1])
    tip = page.evaluate(
        "[document.querySelector('.tip').hidden, document.querySelector('.tip').textContent]"
    )
    assert tip[0] is False
    assert tip[1].startswith("episode 1: ")
    page.ask("Input.dispatchMouseEvent", type="mouseMoved", x=1, y=1)
    assert page.evaluate("document.querySelector('.tip').hidden") is True


def test_the_list_of_trials_can_be_sorted_both_ways(chromium: Browser, page_path: Path) -> None:
    page = chromium.open(page_path)
    costs = "[...document.querySelectorAll('.sortable tbody tr')].map(r => r.cells[3].textContent)"
    click = "document.querySelectorAll('.sortable th')[3].click()"
    page.evaluate("document.querySelector('.listing').open = true")
    page.evaluate(click)
    rising = page.evaluate(costs)
    assert rising[-1] == "\N{EN DASH}", "a lost trial has no cost and comes last"
    numbers = [float(cost) for cost in rising[:-1]]
    assert numbers == sorted(numbers)
    page.evaluate(click)
    falling = page.evaluate(costs)
    assert [float(cost) for cost in falling[:-1]] == numbers[::-1]
    assert falling[-1] == rising[-1]
    assert quiet(page, page_path)


def test_successes_and_failures_can_be_hidden_without_script(
    chromium: Browser, page_path: Path
) -> None:
    page = chromium.open(page_path)
    shown = "getComputedStyle(document.querySelector('.failures')).display"
    assert page.evaluate(shown) != "none"
    page.evaluate("document.querySelector('.hide-bad').checked = false")
    assert page.evaluate(shown) == "none"


def test_a_script_error_and_a_request_would_be_noticed(chromium: Browser, tmp_path: Path) -> None:
    path = tmp_path / "bad.html"
    path.write_text("<!doctype html><img src='gone.png'><script>undefined.x</script>")
    page = chromium.open(path)
    assert any("TypeError" in error for error in page.errors)
    assert (tmp_path / "gone.png").as_uri() in page.requests


def test_a_browser_that_refuses_is_one_clear_error(chromium: Browser) -> None:
    with pytest.raises(RecordError, match=r"the browser refused Nothing\.atAll"):
        chromium.ask("Nothing.atAll")


def test_pictures_are_taken_by_a_command(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "report.png"
    assert screenshot.main([str(whole), str(out), "--width", "800", "--height", "600"]) == 0
    assert pixels(out.read_bytes()).shape == (600, 800, 3)
    assert screenshot.main([str(whole / "nowhere"), str(out)]) == 4
    assert "expected a run folder" in capsys.readouterr().err


def test_without_a_browser_there_is_one_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(RecordError, match="install chromium"), browser():
        pass
