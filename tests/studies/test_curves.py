from __future__ import annotations

import statistics

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.studies.curves import curves, markdown, table, with_error
from shearline.studies.repeat import EVERY, Job, Placement, Repeat


def repeat(learner: str, seed: int, best: list[float], dimensions: int = 5) -> Repeat:
    return Repeat(
        job=Job("sphere", Placement.SHIFTED, dimensions, learner, seed),
        best=best,
        mean=[9.0],
        learner_s=0.5,
        versions={},
        code="",
        run="batch-0001",
        trial=seed,
        evaluator="evaluator-0",
    )


@given(last=st.lists(st.floats(0.0, 100.0), min_size=2, max_size=20))
def test_a_curve_is_mean_and_standard_error_over_seeds(last: list[float]) -> None:
    (curve,) = curves(repeat("lhs", seed, [200.0, value]) for seed, value in enumerate(last))
    assert curve.runs == len(last)
    assert curve.evaluations == [EVERY, 2 * EVERY]
    assert curve.mean[0] == 200.0
    assert curve.mean[1] == pytest.approx(statistics.fmean(last))
    assert curve.se[0] == 0.0
    assert curve.se[1] == pytest.approx(statistics.stdev(last) / len(last) ** 0.5, abs=1e-12)
    assert curve.learner_s == 0.5


def test_learners_and_problems_are_kept_apart_whatever_their_order() -> None:
    cells = [("lhs", 5), ("psp", 5), ("lhs", 10)]
    mixed = [repeat(name, seed, [1.0], n) for seed in range(3) for name, n in cells]
    found = curves(mixed)
    assert [(c.learner, c.dimensions, c.runs) for c in found] == [(a, b, 3) for a, b in cells]


def test_a_single_run_states_no_error() -> None:
    (curve,) = curves([repeat("lhs", 0, [2.0, 1.0])])
    assert curve.se == [0.0, 0.0]


def test_the_table_has_a_row_for_each_learner_and_says_what_is_missing() -> None:
    lines = table(
        curves([repeat("psp", 0, [1.5]), repeat("lhs", 0, [1.0]), repeat("lhs", 0, [3.0], 10)])
    )
    assert lines[0].startswith("sphere, shifted")
    assert "5 parameters" in lines[1]
    assert "10 parameters" in lines[1]
    assert lines[2].split() == ["psp", "1.50", "±", "0.00", "(1)", "-"]
    assert lines[3].split()[0] == "lhs"
    assert len({len(line) for line in lines[1:]}) == 1


def test_the_markdown_says_the_same_and_marks_the_least_of_each_column() -> None:
    lines = markdown(
        curves([repeat("psp", 0, [1.5]), repeat("lhs", 0, [1.0]), repeat("lhs", 0, [3.0], 10)])
    )
    assert lines == [
        "| sphere, shifted | 5 | 10 |",
        "| --- | --- | --- |",
        "| `psp` | 1.50 ± 0.00 | - |",
        "| `lhs` | **1.00 ± 0.00** | **3.00 ± 0.00** |",
    ]


@pytest.mark.parametrize(
    ("mean", "se", "text"),
    [
        (4.887, 0.2816, "4.89 ± 0.28"),
        (162.4, 6.21, "162.4 ± 6.2"),
        (241.0, 13.0, "241 ± 13"),
        (0.0330, 0.0032, "0.0330 ± 0.0032"),
        (0.00031, 0.00004, "(3.1 ± 0.4)e-4"),
        (0.0, 0.0, "0.00 ± 0.00"),
    ],
)
def test_a_figure_has_as_many_digits_as_its_error_means(mean: float, se: float, text: str) -> None:
    assert with_error(mean, se) == text


@given(mean=st.floats(1e-9, 1e6), share=st.floats(0.001, 1.0))
def test_a_figure_read_back_is_within_its_error(mean: float, share: float) -> None:
    text = with_error(mean, share * mean)
    number, exponent = text.strip("(").replace(")", " ± ").split(" ± ")[0], 0
    if "e-" in text:
        exponent = int(text.rpartition("e")[2])
    assert np.isclose(float(number) * 10.0**exponent, mean, rtol=0.06, atol=share * mean)
