"""Goal: what is claimed for a recommendation is true in nine runs out of ten or more."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shearline.deploy.studies.claims import PROBLEMS, coverages
from shearline.learner import Recommendation, Region, Space
from shearline.studies.claims import Claim, claim_of, coverage, table

SPACE = Space.unit(2)
NOISY = ("ridge", "sphere-20", "sphere-2")


def test_a_claim_is_held_to_the_truth_of_tuple_and_region() -> None:
    region = Region(SPACE, np.array([0.5, 0.5]), np.array([0.2, 0.2]), 0.4, 0.95, 60, 50)
    advice = Recommendation(np.array([0.5, 0.6]), 0.9, (0.8, 1.0), 1.0, region)
    claim = claim_of(advice, lambda u: np.where(u[..., 1] > 0.5, 1.0, 0.0), seed=1)
    assert (claim.low, claim.high, claim.success, claim.region_low) == (0.8, 1.0, 1.0, 0.4)
    assert claim.region_success == pytest.approx(0.5, abs=0.05)


def test_coverage_counts_runs_that_kept_their_word() -> None:
    kept = Claim(0.8, 1.0, 0.9, 0.7, 0.75)
    broken = Claim(0.8, 1.0, 0.5, 0.7, 0.6)
    silent = Claim(0.0, 1.0, 0.1, math.nan, math.nan)
    row = coverage("psp", "ridge", [kept, kept, broken, silent])
    assert (row.runs, row.held, row.regions) == (4, 0.75, 3)
    assert row.region_held == pytest.approx(2 / 3)
    assert coverage("psp", "ridge", [silent]).region_held is None


def test_a_row_for_people_has_a_cell_under_each_heading() -> None:
    rows = [coverage("psp", "ridge", [Claim(0.8, 1.0, 0.9, math.nan, math.nan)])]
    head, line = table(rows)
    assert len(head.split()) == len(line.split()) == 9
    assert len(head) == len(line)


@pytest.mark.parametrize("problem", NOISY)
def test_a_broad_policy_claims_little_and_keeps_to_it(problem: str) -> None:
    (row,) = coverages(["lhs"], [problem], range(8))
    assert row.held >= 0.9
    assert row.region_held is not None
    assert row.region_held >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("learner", ["psp", "lhs"])
def test_claims_are_true_in_nine_runs_of_ten(learner: str, problem: str) -> None:
    (row,) = coverages([learner], [problem], range(60))
    assert row.held >= 0.9
    # A hypercube of which one trial in twenty succeeds has at times too few for any region.
    assert row.regions >= (40 if (learner, problem) == ("lhs", "sparse") else 55)
    assert row.region_held is not None
    assert row.region_held >= 0.9
    if learner == "psp":
        assert row.region_low is not None
        assert row.region_low > 0.6  # true, and worth saying
