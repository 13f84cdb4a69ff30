from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner import Space
from shearline.sims.functions import shifted, sphere
from shearline.studies.benchmark import run_learner
from shearline.studies.repeat import (
    EPISODE_LENGTH,
    EPISODES,
    EVERY,
    FUNCTIONS,
    SEEDS_MAX,
    Catalogue,
    Job,
    Placement,
    curve,
    extras,
    jobs,
)

CATALOGUE = Catalogue(("psp", "lhs", "random"))
JOBS = st.builds(
    Job,
    function=st.sampled_from(FUNCTIONS),
    placement=st.sampled_from(Placement),
    dimensions=st.integers(1, 1024),
    learner=st.sampled_from(CATALOGUE.learners),
    seed=st.integers(0, SEEDS_MAX),
)


@given(job=JOBS)
def test_a_job_survives_the_way_through_a_run(job: Job) -> None:
    space = Space(CATALOGUE.space)
    theta = space.denormalise(space.normalise(CATALOGUE.encode(job)))
    assert space.contains(theta)
    assert CATALOGUE.decode(theta.tolist()) == job


def test_a_catalogue_of_one_learner_still_has_a_space() -> None:
    assert Space(Catalogue(("lhs",)).space)["learner"].high == 1.0


def test_an_unknown_learner_is_refused() -> None:
    with pytest.raises(ValueError, match="tuple"):
        CATALOGUE.encode(Job("sphere", Placement.CENTRED, 5, "nobody", 0))


def test_jobs_are_every_combination_once_with_seeds_side_by_side() -> None:
    listed = jobs(["psp", "lhs"], seeds=range(3))
    assert len(listed) == len(set(listed)) == 2 * 2 * 2 * 4 * 3
    assert [job.seed for job in listed[:4]] == [0, 1, 2, 0]


def test_curves_travel_as_extras_and_fit_into_one_result() -> None:
    run = run_learner(
        "lhs", shifted(sphere, 3, 0), episodes=EPISODES, episode_length=EPISODE_LENGTH, seed=0
    )
    numbers = extras(run)
    assert len(numbers) <= 64
    best = curve(numbers, "best")
    assert len(best) == EPISODES * EPISODE_LENGTH // EVERY
    assert best[-1] == run.best
    assert best == sorted(best, reverse=True)
    assert best[0] == run.cost[:EVERY].min()
    np.testing.assert_allclose(np.mean(curve(numbers, "mean")), run.cost.mean())
