from __future__ import annotations

import numpy as np

from shearline.learner.ledger import Trials
from shearline.learner.psp.focus import component_focus
from shearline.learner.psp.proposal import Mixture

#: Components around .2 and .8.
MIXTURE = Mixture(np.array([0.5, 0.5]), np.array([[0.2], [0.8]]), np.full((2, 1, 1), 0.05))


def trials(*groups: tuple[float, int, int, float]) -> Trials:
    """Return trials from groups of ``(place, successes, failures, cost of a success)``."""
    u, cost, success = [], [], []
    for place, wins, losses, price in groups:
        u += [place] * (wins + losses)
        cost += [price] * wins + [14.8] * losses
        success += [True] * wins + [False] * losses
    return Trials(
        np.arange(len(u)), np.array(u)[:, None], np.array(cost), np.array(success, dtype=np.bool_)
    )


def chosen(*groups: tuple[float, int, int, float]) -> float:
    return round(float(component_focus(MIXTURE, trials(*groups)).centre[0]), 9)


def test_of_two_that_hold_alike_the_cheaper_one_is_chosen() -> None:
    assert chosen((0.2, 25, 0, 0.5), (0.8, 25, 0, 0.6)) == 0.2
    assert chosen((0.2, 25, 0, 0.7), (0.8, 25, 0, 0.6)) == 0.8


def test_a_cheap_component_that_fails_loses_against_a_dear_one_that_holds() -> None:
    assert chosen((0.2, 12, 18, 0.25), (0.8, 29, 1, 0.5)) == 0.8


def test_one_lucky_trial_loses_against_many_that_held() -> None:
    assert chosen((0.2, 1, 0, 0.1), (0.8, 40, 2, 0.5)) == 0.8


def test_a_component_without_a_success_is_never_chosen_over_one_with() -> None:
    assert chosen((0.2, 0, 30, 0.0), (0.8, 1, 9, 0.5)) == 0.8


def test_without_any_recent_success_there_is_still_an_answer() -> None:
    assert chosen((0.2, 0, 5, 0.0), (0.8, 0, 5, 0.0)) in (0.2, 0.8)


def test_the_middle_is_that_of_the_successes_which_were_seen() -> None:
    assert chosen((0.75, 10, 3, 0.5), (0.85, 30, 0, 0.5)) == 0.825
