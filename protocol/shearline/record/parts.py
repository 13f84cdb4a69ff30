"""The files of one record: ``record.mcap``, then ``record-1.mcap``, ``record-2.mcap``, ...

A record goes on in a new part when a part is full, and after every interruption. Names and
order live here, nothing of what is inside.
"""

from __future__ import annotations

import fcntl
import re
from pathlib import Path

_PART = re.compile(r"record(?:-(\d+))?\.mcap")
#: More parts than any run has; bounds the search for a free name.
PARTS_MAX = 100_000


def parts(run_dir: Path) -> list[Path]:
    """Return the parts that exist, in the order they were written."""
    return sorted(
        (path for path in run_dir.glob("record*.mcap") if _PART.fullmatch(path.name)), key=number
    )


def number(path: Path) -> int:
    """Return the number of a part; ``record.mcap`` is 0."""
    found = _PART.fullmatch(path.name)
    assert found is not None
    return int(found[1] or 0)


def create_next(run_dir: Path) -> Path:
    """Create the next part, empty, and return its path; two callers never get the same one."""
    last = parts(run_dir)
    for n in range(number(last[-1]) + 1 if last else 0, PARTS_MAX):
        path = run_dir / (f"record-{n}.mcap" if n else "record.mcap")
        try:
            path.touch(exist_ok=False)
        except FileExistsError:
            continue
        return path
    raise AssertionError(f"more than {PARTS_MAX} parts in {run_dir}")


def is_live(path: Path) -> bool:
    """Tell whether someone is writing this part right now."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
