"""Tokens: as many as are asked for, each of its own, each as the doorman knows them."""

from __future__ import annotations

from itertools import islice

from shearline.learner.run.doorman import _TOKEN
from shearline.learner.run.tokens import BATCH, tokens


def test_no_token_comes_twice_across_draws_and_sources() -> None:
    drawn = [*islice(tokens(), 3 * BATCH + 1), *islice(tokens(), BATCH)]
    assert len(set(drawn)) == len(drawn) == 4 * BATCH + 1


def test_every_token_is_one_that_the_doorman_would_look_up() -> None:
    assert all(_TOKEN.fullmatch(token.encode()) for token in islice(tokens(), 2 * BATCH))
