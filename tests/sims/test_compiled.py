"""The cache of compiled functions notices what it must notice."""

from __future__ import annotations

from pathlib import Path

import numba
import pytest

import shearline
from shearline.sims import compiled


def test_the_cache_folder_is_named_after_the_sources() -> None:
    assert Path(numba.config.CACHE_DIR).name == f"shearline-{compiled.source_digest()}"


def test_an_edit_of_any_compiled_source_changes_the_digest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "evaluator" / "skill" / "control.py"
    source.parent.mkdir(parents=True)
    source.write_text("gain = 1.0\n")
    monkeypatch.setattr(shearline, "__path__", [str(tmp_path)])
    before = compiled.source_digest()
    source.write_text("gain = 2.0\n")
    assert compiled.source_digest() != before


def test_a_folder_that_cannot_be_written_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "a-file"
    blocked.write_text("")
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(blocked))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    assert compiled._cache_folder().startswith(str(tmp_path / "home"))
