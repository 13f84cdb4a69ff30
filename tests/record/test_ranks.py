"""Trials are found by number, outcome, cost, and why they failed."""

import pytest
from msgspec.structs import replace

from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Counted, OutcomeKind
from shearline.record.ranks import choose, ranks

GOOD, BAD = OutcomeKind.SUCCESS, OutcomeKind.FAILURE


def a_trial(trial: int, kind: OutcomeKind | None, cost: float, why: str = "") -> Counted:
    return Counted(
        trial=trial,
        episode=0,
        theta=[0.0],
        kind=kind,
        cost=cost,
        seed=0,
        evaluator="sim",
        attempts=1,
        late=False,
        engine="",
        digest="",
        wall_s=0.1,
        why=why,
        extras={},
        at_s=1.0,
    )


RUN = [
    a_trial(0, BAD, 9.0, "torque"),
    a_trial(1, GOOD, 2.0),
    a_trial(2, None, 0.0, "its episode closed without it"),
    a_trial(3, GOOD, 1.0),
    a_trial(4, BAD, 5.0, "time"),
    a_trial(5, BAD, 9.5, "torque"),
]


def test_successes_come_first_by_cost_and_the_lost_last() -> None:
    order = sorted(ranks(RUN), key=ranks(RUN).__getitem__)
    assert order == [3, 1, 4, 0, 5, 2]


@pytest.mark.parametrize(
    ("word", "trial"),
    [("4", 4), ("best", 3), ("worst", 1), ("failure", 4), ("torque", 0), ("time", 4)],
)
def test_a_word_means_one_trial(word: str, trial: int) -> None:
    assert choose(RUN, word) == trial


@pytest.mark.parametrize("word", ["6", "-1", "roi", ""])
def test_a_word_that_means_none_says_what_would(word: str) -> None:
    with pytest.raises(RecordError, match=r"up to 5, or best, worst, failure, time, torque"):
        choose(RUN, word)


def test_a_run_without_success_has_no_best_trial() -> None:
    with pytest.raises(RecordError, match="no trial 'best'"):
        choose([replace(RUN[0])], "best")
