"""Takes pictures of a report in a real browser, for documentation and for those who design it.

Run as ``python -m shearline.record.report.screenshot RUN out.png``; with ``--width 390`` as a
phone shows it, with ``out.pdf`` as it is printed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from shearline.protocol.errors import ShearlineError
from shearline.record.report.browser import browser
from shearline.record.report.write import write


def screenshot(
    run_dirs: Sequence[Path],
    path: Path,
    *,
    width_px: int = 1280,
    height_px: int | None = None,
    dark: bool = False,
) -> None:
    """Write the report of a run, or of several, and a picture of it.

    Args:
        run_dirs: One run folder or more.
        path: PNG or PDF file to write.
        width_px: Of the browser, in CSS pixels.
        height_px: Of the picture; ``None`` for the whole page.
        dark: Whether the reader prefers dark pages.

    Raises:
        RecordError: If there is no such run, or no browser.
    """
    with tempfile.TemporaryDirectory(prefix="shearline-report-") as folder, browser() as chromium:
        page_path = write(run_dirs, Path(folder) / "report.html")
        page = chromium.open(page_path, width_px=width_px, height_px=height_px or 900, dark=dark)
        printed = path.suffix == ".pdf"
        path.write_bytes(page.pdf() if printed else page.screenshot(full=height_px is None))


def main(arguments: Sequence[str] | None = None) -> int:
    """Take one picture as a program; return its exit code."""
    parser = argparse.ArgumentParser(prog="shearline.record.report.screenshot")
    parser.add_argument("run", type=Path, nargs="+", help="run folders")
    parser.add_argument("out", type=Path, help="PNG or PDF file to write")
    parser.add_argument("--width", type=int, default=1280, help="of the browser [px]")
    parser.add_argument("--height", type=int, help="of the picture [px]; default: the whole page")
    parser.add_argument("--dark", action="store_true", help="as seen by who prefers dark pages")
    asked = parser.parse_args(arguments)
    try:
        screenshot(
            asked.run, asked.out, width_px=asked.width, height_px=asked.height, dark=asked.dark
        )
    except (ShearlineError, OSError) as error:
        print(error, file=sys.stderr)  # noqa: T201 - a program's one sentence
        return 4
    return 0


if __name__ == "__main__":
    sys.exit(main())
