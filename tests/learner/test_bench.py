from __future__ import annotations

import pytest

from shearline.learner.bench import measure


def test_a_row_for_each_size_and_share_of_flipped_labels() -> None:
    rows = measure((40, 80), "lhs")
    assert [(row["trials"], row["flipped"]) for row in rows] == [
        (40, 0.0), (40, 0.1), (80, 0.0), (80, 0.1)
    ]  # fmt: skip
    assert all(float(row["ask_s"]) > 0.0 for row in rows)


@pytest.mark.bench
@pytest.mark.slow
def test_an_update_on_five_times_the_bound_costs_no_more_than_on_the_bound() -> None:
    rows = measure((1_000, 10_000), "psp", flipped=(0.1,))
    assert float(rows[1]["ask_s"]) < 2.0 * float(rows[0]["ask_s"])
