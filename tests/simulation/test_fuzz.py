"""Goal: no bytes on any key do harm. Method: spoil messages of a run, look at all they could touch.

50 000 mutants on every push; ``make fuzz`` tries a million.
"""

from __future__ import annotations

import pytest
from simulation.fuzz import Fuzz
from simulation.plants import PLANTS


def spoil(count: int, seed: int) -> None:
    """Fuzz, and see that every fate a message can have was met often."""
    tally = Fuzz(seed).run(count)
    assert tally.refused + tally.harmless + tally.allowed == count
    assert min(tally) > count / 200


def test_two_thousand_mutants_are_refused_or_harmless_or_their_senders_own() -> None:
    spoil(2_000, 1)


@pytest.mark.slow
def test_fifty_thousand_mutants_are_refused_or_harmless_or_their_senders_own() -> None:
    spoil(50_000, 2)


@pytest.mark.slow
@pytest.mark.long
def test_a_million_mutants_are_refused_or_harmless_or_their_senders_own() -> None:
    spoil(1_000_000, 3)


def test_a_learner_that_believes_tokens_from_anyone_is_found_out() -> None:
    with PLANTS["tokens believed from anyone"].planted(), pytest.raises(AssertionError):
        Fuzz(0).run(5_000)
