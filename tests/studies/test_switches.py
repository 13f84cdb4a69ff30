from __future__ import annotations

from shearline.sims.functions import shifted, sphere
from shearline.studies.switches import VARIANTS, switches


def test_every_variant_runs_and_has_its_row() -> None:
    rows = switches(lambda seed: shifted(sphere, 2, seed), seeds=[0], episodes=3, episode_length=10)
    assert [row.learner for row in rows] == list(VARIANTS)
    assert all(row.best < 50.0 for row in rows)
