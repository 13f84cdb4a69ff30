"""Everything at once: every trial is counted once, and what was acknowledged stays."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from chaos.fleet import Fleet
from chaos.mayhem import Mayhem

from shearline.learner.dispatcher.entries import AnyEntry, AttemptIssued, ResultTaken
from shearline.protocol.messages import Verdict

pytestmark = pytest.mark.chaos

TRIAL_S = 0.04


def asked(folder: Path, episodes: int, trials: int) -> list[str]:
    """Return what to run; a trial may lose many attempts, for here all of them are killed."""
    file = folder / "mayhem.toml"
    file.write_text("losses_max = 50\n")
    return [
        str(file), "--task", "sleep-40", "--learner", "lhs", "--episodes", str(episodes),
        "--trials", str(trials), "--lease", "1", "--no-record",
    ]  # fmt: skip


def wall_s(entries: Sequence[AnyEntry]) -> float:
    """Return the time from the first attempt to the last outcome [s]."""
    first = next(e.at_s for e in entries if isinstance(e, AttemptIssued))
    counted = [e for e in entries if isinstance(e, ResultTaken) and e.verdict is Verdict.COUNTED]
    return counted[-1].at_s - first


def test_a_hundred_trials_through_everything_at_once(tmp_path: Path) -> None:
    with Fleet(tmp_path, asked(tmp_path, 3, 40)) as fleet:
        mayhem = Mayhem(fleet, ("a", "b", "c"), kill_learner_at=(60,), every_s=1.0)
        mayhem.run()
        assert len(fleet.audit().counted) == 120
        assert mayhem.done["learner killed"] == 1


@pytest.mark.long
def test_six_hundred_trials_through_everything_at_once(tmp_path: Path) -> None:
    with Fleet(tmp_path, asked(tmp_path, 6, 100)) as fleet:
        mayhem = Mayhem(fleet, ("a", "b", "c", "d"), kill_learner_at=(150, 300, 450))
        entries = mayhem.run()
        audit = fleet.audit()
        assert len(audit.counted) == 600
        ideal_s = 600 * TRIAL_S / 4
        took_s = wall_s(entries)
        duplicates = fleet.summary()["duplicates"]
        sys.stdout.write(
            f"\n600 trials on 4 evaluators: {took_s:.1f} s, ideal {ideal_s:.1f} s,"
            f" {took_s / ideal_s:.2f}x; {len(audit.attempts)} attempts,"
            f" {duplicates} duplicates in the last life, {dict(mayhem.done)}\n"
        )
        assert took_s <= 3.0 * ideal_s
