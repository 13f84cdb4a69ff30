from __future__ import annotations

import pytest

from shearline.sims.functions import shifted, sphere
from shearline.studies.switches import PARTITIONERS, TABLES, switches


@pytest.mark.parametrize("table", TABLES)
def test_every_variant_runs_and_has_its_row(table: str) -> None:
    rows = list(
        switches(
            lambda seed: shifted(sphere, 2, seed),
            TABLES[table],
            seeds=[0],
            episodes=3,
            episode_length=10,
        )
    )
    assert [row.learner for row in rows] == list(TABLES[table])
    assert all(row.best < 50.0 for row in rows)


def test_each_partitioner_finds_something_else() -> None:
    """No row is another one's by a slip in a name."""
    four = dict(list(PARTITIONERS.items())[:4])
    rows = switches(
        lambda seed: shifted(sphere, 5, seed), four, seeds=[0], episodes=4, episode_length=20
    )
    assert len({row.best for row in rows}) == 4
