"""Writes a report to its file, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from shearline.protocol.errors import RecordError
from shearline.record.report.compare import compare
from shearline.record.report.page import report

#: Where a report stands unless told otherwise.
NAME = "report.html"
COMPARISON = "comparison.html"


def write(run_dirs: Sequence[Path], out: Path | None = None) -> Path:
    """Write the report of one run, or the comparison of several, and return its path.

    Args:
        run_dirs: One run folder or more.
        out: File to write; by default ``report.html`` in the run folder, or ``comparison.html``
            in the present folder.

    Raises:
        RecordError: If a folder is not there or the file cannot be written.
    """
    (first, *others) = run_dirs
    text = compare(run_dirs) if others else report(first)
    path = out or (Path(COMPARISON) if others else _folder(first) / NAME)
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        beside.write_text(text, encoding="utf-8")
        beside.replace(path)
    except OSError as fault:
        beside.unlink(missing_ok=True)
        raise RecordError(f"cannot write {path}: {fault.strerror}: choose another file") from None
    return path


def _folder(run_dir: Path) -> Path:
    return run_dir if run_dir.is_dir() else run_dir.parent
