"""A learner that starts from another run: from its trials, which fade, and never on their word."""

from __future__ import annotations

from importlib.util import find_spec

import msgspec
import numpy as np
import pytest

from shearline.learner import LearnerError, Space, create
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.prior import Prior, left
from shearline.learner.registry import EXTRAS, LEARNERS, PRIMED

SPACE = Space({"x": ("m", -1.0, 3.0), "y": ("", 0.0, 1.0), "z": ("N", 0.0, 20.0)})
GOAL = np.array([2.0, 0.2, 15.0])
CAN = [name for name in sorted(PRIMED) if name not in EXTRAS or find_spec("optuna")]


def outcome(theta: np.ndarray) -> tuple[float, bool]:
    cost = float(np.sum(((theta - GOAL) / (SPACE.high - SPACE.low)) ** 2))
    return cost, cost < 0.1


def prior(trials: int = 200) -> Prior:
    drawn = SPACE.denormalise(np.random.default_rng(3).random((trials, 3)))
    told = [outcome(theta) for theta in drawn]
    return Prior(
        run="other",
        task="bowl",
        theta=drawn.tolist(),
        cost=[cost for cost, _ in told],
        success=[won for _, won in told],
    )


def made(name: str, start: Prior | None = None, seed: int = 0) -> EpisodicLearner:
    learner = create(name, SPACE, 20, seed)
    assert isinstance(learner, EpisodicLearner)
    if start is not None:
        learner.prime(start)
    return learner


def run(learner: EpisodicLearner, episodes: int) -> np.ndarray:
    proposed = []
    for _ in range(episodes):
        for p in learner.ask(20):
            cost, won = outcome(p.theta)
            learner.tell(p.trial, cost=cost, success=won)
            proposed.append(p.theta)
    return np.array(proposed)


@pytest.mark.parametrize("name", CAN)
def test_the_first_episode_is_drawn_from_what_the_other_run_found(name: str) -> None:
    cold, warm = run(made(name), 1), run(made(name, prior()), 1)
    assert np.mean([outcome(u)[0] for u in warm]) < 0.8 * np.mean([outcome(u)[0] for u in cold])


@pytest.mark.parametrize("name", CAN)
def test_another_run_that_only_failed_stops_nobody(name: str) -> None:
    lost = msgspec.structs.replace(prior(), success=[False] * 200)
    proposed = run(made(name, lost), 2)
    assert np.all((proposed >= SPACE.low) & (proposed <= SPACE.high))


@pytest.mark.parametrize("boundary", ["transform", "penalty"])
def test_cmaes_starts_where_the_other_run_stood_be_it_on_the_wall(boundary: str) -> None:
    line = Space({"x": ("m", 0.0, 2.0)})
    learner = create("cmaes", line, 20, seed=0, boundary=boundary)
    assert isinstance(learner, EpisodicLearner)
    learner.prime(Prior(theta=[[2.0]] * 9, cost=[1.0] * 9, success=[True] * 9))
    first = np.array([p.theta for p in learner.ask(20)])
    assert np.all(first <= 2.0)
    assert first.mean() > 1.5


@pytest.mark.parametrize("name", CAN)
def test_the_same_prior_and_seed_give_the_same_proposals(name: str) -> None:
    assert np.array_equal(run(made(name, prior()), 3), run(made(name, prior()), 3))


@pytest.mark.parametrize("name", CAN)
def test_nothing_is_claimed_on_the_word_of_another_run(name: str) -> None:
    learner = made(name, prior())
    for p in learner.ask(20):
        learner.tell(p.trial, cost=9.0, success=False)
    said = learner.recommend()
    assert said.interval[0] == 0.0
    assert np.isnan(said.cost)


def test_a_prior_fades_by_half_with_every_episode_the_latest_last() -> None:
    assert [left(200, episode) for episode in range(9)] == [200, 100, 50, 25, 12, 6, 3, 1, 0]


def test_a_faded_prior_leaves_what_the_run_itself_found() -> None:
    learner = made("tpe" if find_spec("optuna") else "psp", prior(2))
    run(learner, 3)
    assert (learner._ledger.known(0).number[:3]).tolist() == [-2, -1, 0]
    assert (learner._ledger.known(2).number[:1]).tolist() == [0]


@pytest.mark.parametrize("name", sorted({*LEARNERS} - PRIMED))
def test_who_cannot_start_from_another_run_says_so(name: str) -> None:
    with pytest.raises(LearnerError, match=f"{name} cannot start from another run"):
        made(name, prior())


def test_it_is_too_late_once_something_was_asked_for() -> None:
    learner = made("psp")
    learner.ask(1)
    with pytest.raises(LearnerError, match="before that"):
        learner.prime(prior())
