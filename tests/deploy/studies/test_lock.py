from __future__ import annotations

import json
from pathlib import Path

import pytest

from shearline.deploy.studies.lock import Experiment, experiments
from shearline.protocol.errors import RecordError


def study(folder: Path, seeds: range) -> list[Experiment]:
    return list(experiments("sleep-0", "lhs", seeds, evaluators=1, fresh=7, folder=folder))


@pytest.mark.slow
def test_an_experiment_is_a_run_and_fresh_trials_and_is_not_run_twice(tmp_path: Path) -> None:
    (one,) = study(tmp_path, range(3, 4))
    summary = json.loads((tmp_path / "sleep-0-lhs-3-7" / "summary.json").read_text())
    assert len(one.success) == 10
    assert one.late_success == pytest.approx(sum(one.success[-3:]) / 3)
    assert one.fresh_success * 7 == pytest.approx(summary["confirmation"]["successes"])
    assert summary["counted"] == 207
    assert study(tmp_path, range(3, 4)) == [one]


def test_a_summary_that_cannot_be_read_is_said(tmp_path: Path) -> None:
    run_dir = tmp_path / "sleep-0-lhs-0-7"
    run_dir.mkdir()
    (run_dir / "summary.json").write_text("{")
    with pytest.raises(RecordError, match="summary"):
        study(tmp_path, range(1))
