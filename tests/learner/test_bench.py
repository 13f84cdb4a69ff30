from __future__ import annotations

import pytest

from shearline.learner.bench import PROPOSALS, Row, _times, measure
from shearline.learner.errors import UnknownLearnerError

#: What an update may cost more on ten times the data.
RATIO_MAX = 2.0
#: What may be needed at 100 000 trials: each is 23 numbers, held a few times over [MB].
MEMORY_MB_MAX = 300.0


def test_every_part_takes_time() -> None:
    assert min(_times("lhs", 2 * PROPOSALS, 0.1)) > 0.0


def test_an_unknown_learner_is_refused_before_anything_is_measured() -> None:
    with pytest.raises(UnknownLearnerError):
        measure("pps")


@pytest.mark.slow
def test_a_row_for_each_size_and_share_of_flipped_labels() -> None:
    rows = list(measure("lhs", (40, 100_000)))
    assert [(row.trials, row.flipped) for row in rows] == [
        (40, 0.0), (40, 0.1), (100_000, 0.0), (100_000, 0.1)
    ]  # fmt: skip
    assert rows[-1].tell_s > rows[0].tell_s
    # What the imports had needed for a moment hides a part of it.
    assert rows[-1].memory_mb > 0.5 * 100_000 * 23 * 8 / 1e6


@pytest.mark.bench
@pytest.mark.slow
@pytest.mark.parametrize("flipped", [0.0, 0.1])
@pytest.mark.parametrize("learner", ["psp", "psp-ranked"])
def test_an_update_on_ten_times_the_data_costs_little_more(learner: str, flipped: float) -> None:
    few, many = by_size(learner, flipped)
    assert many.ask_s < RATIO_MAX * few.ask_s
    assert many.memory_mb < MEMORY_MB_MAX


def by_size(learner: str, flipped: float) -> tuple[Row, Row]:
    """Return what 10 000 and 100 000 trials cost: of three times each, the one least disturbed."""
    times = [list(measure(learner, (10_000, 100_000), (flipped,))) for _ in range(3)]
    few, many = (min(rows, key=lambda row: row.ask_s) for rows in zip(*times, strict=True))
    return few, many
