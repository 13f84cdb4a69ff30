"""The learners' contract as a test anyone can hold their own learner to.

::

    from shearline.learner.testing import LearnerContract

    class TestMyLearner(LearnerContract):
        def make(self, space, episode_length, seed):
            return MyLearner(space, episode_length, seed)

It needs pytest and knows nothing of any particular learner.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable

import numpy as np
import pytest

from shearline.learner.base import Array, Learner, Proposal
from shearline.learner.errors import LearnerError
from shearline.protocol.space import Space

#: What a test makes of one tuple: cost and success.
Verdict = Callable[[Proposal], tuple[float, bool]]

EPISODE = 8


def space_of(n: int) -> Space:
    """Return ``n`` parameters with unequal, lopsided bounds in made-up units."""
    return Space({f"p{i}": ("N", -1.0 - i, 0.5 + 2.0 * i) for i in range(n)})


def bowl(proposal: Proposal) -> tuple[float, bool]:
    """Cost grows from the middle of the box; the outer part fails."""
    distance = float(np.mean(np.square(proposal.theta)))
    return distance, distance < 10.0


def thetas(proposals: Iterable[Proposal]) -> Array:
    """Stack proposals into ``(count, n)``."""
    return np.array([p.theta for p in proposals])


def report(learner: Learner, proposals: Iterable[Proposal], verdict: Verdict = bowl) -> None:
    """Tell what became of proposals, in the order given."""
    for p in proposals:
        cost, success = verdict(p)
        learner.tell(p.trial, cost=cost, success=success)


def play(learner: Learner, episodes: int, verdict: Verdict = bowl) -> list[Proposal]:
    """Ask and tell whole episodes in order; return all proposals."""
    asked: list[Proposal] = []
    for _ in range(episodes):
        proposals = learner.ask(learner.episode_length)
        asked += proposals
        report(learner, proposals, verdict)
    return asked


class LearnerContract(ABC):
    """Inherit, say how to make your learner, and let pytest collect the rest."""

    @abstractmethod
    def make(self, space: Space, episode_length: int, seed: int) -> Learner:
        """Return a fresh learner."""

    def fresh(self, n: int = 3, seed: int = 1) -> Learner:
        """Return a fresh learner over ``n`` parameters with short episodes."""
        return self.make(space_of(n), EPISODE, seed)

    # -- asking ----------------------------------------------------------------------------------

    def test_it_is_a_learner(self) -> None:
        """The object has the attributes and methods of the protocol."""
        learner = self.fresh()
        assert isinstance(learner, Learner)
        assert learner.episode_length == EPISODE

    @pytest.mark.parametrize("n", [1, 2, 23, 100])
    def test_proposals_have_the_shape_of_the_space_and_lie_within_it(self, n: int) -> None:
        """One parameter or a hundred, through several updates."""
        learner = self.fresh(n)
        for p in play(learner, 4):
            assert p.theta.shape == (n,)
            assert learner.space.contains(p.theta)

    def test_trials_are_numbered_in_the_order_they_are_asked_for(self) -> None:
        """From 0, without gaps, over episodes and calls."""
        learner = self.fresh()
        asked = [p.trial for count in (1, 5, 20, 3) for p in learner.ask(count)]
        assert asked == list(range(29))

    @pytest.mark.parametrize("count", [0, -1, 10**9])
    def test_asking_for_a_senseless_number_is_refused(self, count: int) -> None:
        """And leaves the learner as it was."""
        learner = self.fresh()
        with pytest.raises(LearnerError):
            learner.ask(count)
        assert learner.ask(1)[0].trial == 0

    def test_asking_for_more_than_an_episode_crosses_into_the_next(self) -> None:
        """With nothing told in between, and goes on from there."""
        learner = self.fresh()
        proposals = learner.ask(3 * EPISODE + 2)
        for p in proposals:
            learner.tell(p.trial, cost=1.0, success=True)
        assert learner.ask(EPISODE)[-1].trial == 4 * EPISODE + 1

    @pytest.mark.parametrize("chunks", [[1] * EPISODE, [3, 5], [7, 1]])
    def test_the_chunks_of_ask_do_not_change_what_is_proposed(self, chunks: list[int]) -> None:
        """One episode in one call, in a few, or one by one."""
        whole, pieces = self.fresh(), self.fresh()
        for _ in range(3):
            one = whole.ask(EPISODE)
            other = [p for count in chunks for p in pieces.ask(count)]
            np.testing.assert_array_equal(thetas(one), thetas(other))
            report(whole, one)
            report(pieces, other)

    # -- seeds and order -------------------------------------------------------------------------

    def test_the_same_seed_and_outcomes_give_the_same_proposals(self) -> None:
        """Bit for bit, over several updates."""
        first, second = play(self.fresh(seed=5), 5), play(self.fresh(seed=5), 5)
        np.testing.assert_array_equal(thetas(first), thetas(second))

    def test_another_seed_gives_other_proposals(self) -> None:
        """Already in the first episode."""
        first, second = self.fresh(seed=5).ask(EPISODE), self.fresh(seed=6).ask(EPISODE)
        assert not np.array_equal(thetas(first), thetas(second))

    @pytest.mark.parametrize("shuffle", [0, 1, 2])
    def test_the_order_of_tells_within_an_episode_changes_nothing(self, shuffle: int) -> None:
        """Shuffled anew in every episode."""
        rng = np.random.default_rng(shuffle)
        ordered, shuffled = self.fresh(), self.fresh()
        for _ in range(4):
            one, other = ordered.ask(EPISODE), shuffled.ask(EPISODE)
            np.testing.assert_array_equal(thetas(one), thetas(other))
            report(ordered, one)
            report(shuffled, [other[i] for i in rng.permutation(EPISODE)])
        np.testing.assert_array_equal(ordered.recommend().theta, shuffled.recommend().theta)

    def test_what_is_told_within_an_episode_does_not_change_its_rest(self) -> None:
        """It counts from the next one on: told at once or at the end is the same."""
        eager, patient = self.fresh(), self.fresh()
        for _ in range(3):
            whole = patient.ask(EPISODE)
            first = eager.ask(3)
            report(eager, first)
            rest = eager.ask(EPISODE - 3)
            np.testing.assert_array_equal(thetas(whole), thetas(first + rest))
            report(eager, rest)
            report(patient, whole)

    def test_learners_side_by_side_do_not_disturb_each_other(self) -> None:
        """Nor does anyone who uses numpy's global generator, which stays as it was."""
        alone = play(self.fresh(seed=5), 3)
        other, together = self.fresh(seed=6), self.fresh(seed=5)
        state = np.random.get_state()  # noqa: NPY002 - it is what must not be touched
        asked: list[Proposal] = []
        for k in range(3):
            play(other, 1)
            np.testing.assert_equal(np.random.get_state(), state)  # noqa: NPY002
            np.random.seed(k)  # noqa: NPY002
            state = np.random.get_state()  # noqa: NPY002
            asked += play(together, 1)
        np.testing.assert_array_equal(thetas(alone), thetas(asked))

    def test_what_was_proposed_is_the_askers_to_change(self) -> None:
        """Writing into a tuple changes nothing that the learner knows."""
        careful, careless = self.fresh(), self.fresh()
        for _ in range(3):
            one, other = careful.ask(EPISODE), careless.ask(EPISODE)
            np.testing.assert_array_equal(thetas(one), thetas(other))
            report(careful, one)
            report(careless, other)
            for p in other:
                p.theta[:] = np.nan

    # -- telling ---------------------------------------------------------------------------------

    def test_missing_outcomes_are_legal(self) -> None:
        """Every third trial is never heard of again."""
        learner = self.fresh()
        for _ in range(4):
            for p in learner.ask(EPISODE):
                if p.trial % 3:
                    learner.tell(p.trial, cost=1.0 + p.trial, success=True)
        assert learner.space.contains(learner.recommend().theta)

    @pytest.mark.parametrize("n", [1, 23])
    def test_outcomes_may_all_be_missing(self, n: int) -> None:
        """It goes on proposing, recommends something, and claims nothing for it."""
        learner = self.fresh(n)
        for p in learner.ask(4 * EPISODE):
            assert learner.space.contains(p.theta)
        answer = learner.recommend()
        assert learner.space.contains(answer.theta)
        assert answer.interval[0] == 0.0

    def test_late_outcomes_are_legal_in_any_order(self) -> None:
        """Told two episodes after they were asked for, in between others."""
        ordered, shuffled = self.fresh(), self.fresh()
        late = ordered.ask(EPISODE)
        shuffled.ask(EPISODE)
        for learner in (ordered, shuffled):
            play(learner, 2)
        recent = ordered.ask(EPISODE)
        shuffled.ask(EPISODE)
        report(ordered, late + recent)
        report(shuffled, [*recent[::-1], *late[::-1]])
        one, other = play(ordered, 2), play(shuffled, 2)
        np.testing.assert_array_equal(thetas(one), thetas(other))

    def test_an_outcome_told_again_much_later_counts_once(self) -> None:
        """Episodes after it was first told."""
        once, again = self.fresh(), self.fresh()
        first = play(once, 1)
        play(again, 1)
        for _ in range(3):
            one, other = play(once, 1), play(again, 1)
            np.testing.assert_array_equal(thetas(one), thetas(other))
            report(again, first)

    def test_an_outcome_told_twice_counts_once(self) -> None:
        """The second telling changes nothing."""
        once, twice = self.fresh(), self.fresh()
        for _ in range(3):
            report(once, once.ask(EPISODE))
            proposals = twice.ask(EPISODE)
            report(twice, [p for p in proposals for _ in range(2)])
        np.testing.assert_array_equal(thetas(once.ask(EPISODE)), thetas(twice.ask(EPISODE)))

    def test_a_second_other_outcome_is_refused_and_the_first_stands(self) -> None:
        """An outcome is final."""
        learner = self.fresh()
        trial = learner.ask(1)[0].trial
        learner.tell(trial, cost=1.0, success=True)
        with pytest.raises(LearnerError):
            learner.tell(trial, cost=2.0, success=True)
        with pytest.raises(LearnerError):
            learner.tell(trial, cost=1.0, success=False)
        learner.tell(trial, cost=1.0, success=True)

    @pytest.mark.parametrize("trial", [-1, 3, 10**6])
    def test_a_trial_that_was_never_asked_for_is_refused(self, trial: int) -> None:
        """Three were asked for."""
        learner = self.fresh()
        learner.ask(3)
        with pytest.raises(LearnerError):
            learner.tell(trial, cost=1.0, success=True)

    @pytest.mark.parametrize("cost", [float("nan"), float("inf"), float("-inf")])
    @pytest.mark.parametrize("success", [True, False])
    def test_a_cost_that_is_not_finite_is_refused(self, cost: float, success: bool) -> None:  # noqa: FBT001 - pytest passes it
        """For a failure as for a success; the trial can still be told."""
        learner = self.fresh()
        trial = learner.ask(1)[0].trial
        with pytest.raises(LearnerError):
            learner.tell(trial, cost=cost, success=success)
        learner.tell(trial, cost=1.0, success=success)

    def test_numbers_of_any_kind_are_told(self) -> None:
        """Whole numbers and numpy's own; a snapshot still holds plain ones."""
        learner = self.fresh()
        for p in learner.ask(EPISODE):
            cost, success = bowl(p)
            learner.tell(p.trial, cost=np.float64(cost), success=success)
        for p in learner.ask(EPISODE):
            learner.tell(p.trial, cost=p.trial, success=True)
        learner.ask(1)
        _assert_plain(dict(learner.snapshot()))

    # -- hard cases ------------------------------------------------------------------------------

    @pytest.mark.parametrize("success", [True, False])
    @pytest.mark.parametrize("n", [1, 23, 100])
    def test_equal_costs_leave_it_working(self, n: int, success: bool) -> None:  # noqa: FBT001
        """All succeed alike, or all fail."""
        learner = self.fresh(n)
        play(learner, 4, lambda _: (0.3, success))
        assert learner.space.contains(learner.ask(1)[0].theta)
        assert learner.space.contains(learner.recommend().theta)

    def test_a_single_success_leaves_it_working(self) -> None:
        """Among three episodes of failures."""
        learner = self.fresh(23)
        play(learner, 3, lambda p: (0.5, True) if p.trial == 5 else (14.8, False))
        play(learner, 2)

    @pytest.mark.parametrize("scale", [1e-12, -1.0, 1e12])
    def test_costs_of_any_sign_and_size_leave_it_working(self, scale: float) -> None:
        """Tiny, negative, huge."""
        learner = self.fresh()
        play(learner, 4, lambda p: (scale * bowl(p)[0], bowl(p)[1]))
        assert learner.space.contains(learner.recommend().theta)

    def test_duplicate_points_with_contradicting_outcomes_leave_it_working(self) -> None:
        """A narrow space makes proposals coincide; success alternates."""
        space = Space({"p": ("", 1.0, 1.0 + 1e-15)})
        learner = self.make(space, EPISODE, 1)
        play(learner, 4, lambda p: (1.0, p.trial % 2 == 0))
        assert space.contains(learner.recommend().theta)

    def test_episodes_of_one_trial_are_legal(self) -> None:
        """An update after every trial."""
        learner = self.make(space_of(2), 1, 1)
        play(learner, 20)

    # -- answers ---------------------------------------------------------------------------------

    def test_recommending_before_asking_is_refused(self) -> None:
        """There is nothing to stand on."""
        with pytest.raises(LearnerError):
            self.fresh().recommend()

    def test_a_recommendation_is_consistent(self) -> None:
        """A tuple within bounds, a probability within its interval, a finite cost."""
        learner = self.fresh()
        play(learner, 4)
        answer = learner.recommend()
        low, high = answer.interval
        assert learner.space.contains(answer.theta)
        assert 0.0 <= low <= answer.success_probability <= high <= 1.0
        assert np.isfinite(answer.cost)
        if answer.region is not None:
            assert 0.0 <= answer.region.success_low <= 1.0
            draws = answer.region.sample(np.random.default_rng(0), 20)
            assert all(answer.region.contains(theta) for theta in draws)

    def test_without_a_success_the_cost_is_not_a_number_and_nothing_is_claimed(self) -> None:
        """A lower bound of 0."""
        learner = self.fresh()
        play(learner, 2, lambda _: (14.8, False))
        answer = learner.recommend()
        assert np.isnan(answer.cost)
        assert answer.interval[0] == 0.0

    def test_recommending_changes_nothing(self) -> None:
        """Nor does a snapshot."""
        quiet, curious = self.fresh(), self.fresh()
        play(quiet, 2)
        play(curious, 2)
        curious.recommend()
        curious.snapshot()
        np.testing.assert_array_equal(thetas(quiet.ask(EPISODE)), thetas(curious.ask(EPISODE)))

    @pytest.mark.parametrize("episodes", [0, 1, 4])
    def test_a_snapshot_is_plain_values(self, episodes: int) -> None:
        """Numbers, strings, lists and dicts all the way down, at any time."""
        learner = self.fresh()
        play(learner, episodes)
        _assert_plain(dict(learner.snapshot()))


def _assert_plain(value: object) -> None:
    match value:
        case dict():
            assert all(isinstance(key, str) for key in value)
            for item in value.values():
                _assert_plain(item)
        case list():
            for item in value:
                _assert_plain(item)
        case bool() | int() | str() | None:
            pass
        case float():
            assert np.isfinite(value), "a snapshot is sent as JSON, which has no nan"
        case _:
            raise AssertionError(f"a snapshot holds plain values, found {type(value).__name__}")
