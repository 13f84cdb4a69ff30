"""One trial of figure 4's task is one whole repeat, and its result says everything about it."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from shearline.deploy.studies.task import NAME, encode, problem, repeat_of
from shearline.evaluator import load_task
from shearline.evaluator.local import run_trial
from shearline.learner.registry import LEARNERS
from shearline.protocol.messages import OutcomeKind
from shearline.protocol.task import digest
from shearline.sims.functions import optimum
from shearline.studies.benchmark import run_learner
from shearline.studies.provenance import code_of, versions
from shearline.studies.repeat import Job, Placement

JOB = Job("rastrigin", Placement.SHIFTED, 4, "lhs", 3)


def test_a_trial_is_the_run_that_the_learner_alone_would_have_made() -> None:
    task = load_task(NAME)
    verdict = run_trial(task, encode(JOB), seed=99)
    alone = run_learner("lhs", problem(JOB), episodes=10, episode_length=40, seed=3)
    assert verdict.kind is OutcomeKind.SUCCESS
    assert verdict.cost == alone.best
    found = repeat_of(
        task.spec,
        encode(JOB),
        verdict.extras,
        run="batch-0001",
        trial=0,
        evaluator="evaluator-0",
    )
    assert found.job == JOB
    assert found.best == alone.best_every(10).tolist()
    assert found.mean == alone.mean_by_episode.tolist()
    assert found.versions == versions()
    assert found.code == code_of("lhs")


def test_the_seed_is_the_jobs_own_and_not_the_trials() -> None:
    task = load_task(NAME)
    costs = [run_trial(task, encode(JOB), seed=seed).cost for seed in (0, 1)]
    other = run_trial(task, encode(msgspec.structs.replace(JOB, seed=4)), seed=0).cost
    assert costs[0] == costs[1] != other


@pytest.mark.parametrize("function", ["sphere", "rastrigin"])
def test_a_problem_has_its_optimum_where_the_job_says(function: str) -> None:
    for n in (2, 7):
        middle = problem(Job(function, Placement.CENTRED, n, "lhs", 1))
        moved = problem(Job(function, Placement.SHIFTED, n, "lhs", 1))
        assert middle.trial(np.zeros(n), np.random.default_rng(0)) == (0.0, True)
        assert float(moved.cost(optimum(n, 1))) == pytest.approx(0.0, abs=1e-12)
        assert float(moved.cost(np.zeros(n))) > 0.5


def test_an_evaluator_with_other_code_or_learners_means_another_task() -> None:
    spec = load_task(NAME).spec
    assert spec.options["learners"] == " ".join(LEARNERS)
    for name in ("learners", "code psp", "version numpy"):
        other = msgspec.structs.replace(spec, options={**spec.options, name: "other"})
        assert digest(other) != digest(spec)
